// SPDX-License-Identifier: Apache-2.0
// Internal: from the pixels of a lamp to its blink as a signal over lines.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/stripe_centre.hpp"
#include "libocc/detect/internal/stripe_signal.hpp"
#include "libocc/detect/internal/stripe_window.hpp"

namespace occ::internal::detect {

/// The ellipse |shape d| = rim on each line.
class OutlineChords {
 public:
  OutlineChords(const StripedShape& shape, double rim)
      : centre_(shape.centre), metric_(shape.shape.transpose() * shape.shape), rim_(rim) {}

  double half_lines() const { return rim_ * std::sqrt(metric_.inverse()(0, 0)); }
  double along() const { return metric_(1, 1); }

  struct Chord {
    double middle, half;  ///< pos
    double across;        ///< |shape d|^2 at the middle
  };
  Chord at(int line) const {
    const double dl = line - centre_[0];
    const double slope = metric_(0, 1) / metric_(1, 1);
    const double across = (metric_(0, 0) - slope * metric_(0, 1)) * dl * dl;
    const double half = std::sqrt(std::max(0.0, (rim_ * rim_ - across) / metric_(1, 1)));
    return {centre_[1] - slope * dl, half, across};
  }

 private:
  Eigen::Vector2d centre_;
  Eigen::Matrix2d metric_;
  double rim_;
};

/// Mean along a line of log(1 + signal / floor): compresses a glow's range to that of its stripes.
LineSignal compressed_signal(const LineWindow& window, const LineBox& part, double floor);

/// The part of the outline, by its size, that is as bright as the shape says.
double dependable_part(const StripedShape& shape);

enum class Side { both, low, high };

/// Signal of each line over the signal that the lamp would have without blinking; what is left is
/// the blink. Lines that the lamp hardly covers have weight 0.
LineSignal demodulated_signal(const LineWindow& window, const StripedShape& shape, double clipped,
                              Side side = Side::both);

}  // namespace occ::internal::detect
