// SPDX-License-Identifier: Apache-2.0
// Internal: samples folded into one period of a code, and the light that a code would show there.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/codes/decode_samples.hpp"
#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ::internal::codes {

/// Sums over the samples of one step of the period, by channel.
struct FoldedBin {
  int step = 0;
  std::vector<double> weight, weighted;  ///< of w and w value, w = 1 / sigma^2
};

/// Only bins that have samples, by their step.
std::vector<FoldedBin> fold(const std::vector<LightSample>& samples, const SlotCode& code,
                            int steps_per_chip, double clock_error, double origin_s);

/// What the camera gets of the patterns: offset + mixing * light.
struct Levels {
  Eigen::VectorXd offset;
  Eigen::MatrixXd mixing;

  explicit Levels(int channels)
      : offset(Eigen::VectorXd::Zero(channels)),
        mixing(Eigen::MatrixXd::Identity(channels, channels)) {}
};

/// Light of each pattern, averaged over an exposure about the middle of each step, by channel.
class PatternLight {
 public:
  PatternLight(const SlotCode& code, int steps_per_chip, double exposure_s);

  /// Steps of a pattern by channels.
  const Eigen::MatrixXd& of(int pattern) const { return light_[pattern]; }

 private:
  std::vector<Eigen::MatrixXd> light_;
};

}  // namespace occ::internal::codes
