// SPDX-License-Identifier: Apache-2.0
// Internal: whether the lamps of a hypothesis have the outlines that its pose shows.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/identify/internal/pose_hypothesis.hpp"

namespace occ::internal::identify {

/// Compares the second moments of the outlines in the image with those that lamps with axes
/// have there under weak perspective. Three blobs fit a pose for any three lamps: only the outlines
/// tell which.
class OutlineMisfit {
 public:
  /// Keeps a reference.
  explicit OutlineMisfit(const AssignmentProblem& problem);

  /// Chi-square of the pairs whose blob has a whole outline, of each pair at most nine: something
  /// may hide a part of it.
  double of(const PoseHypothesis& hypothesis) const;

 private:
  double of(const Pair& pair, const Rigid3& pose) const;

  const AssignmentProblem& problem_;
  std::vector<Eigen::Matrix2d> moments_m2_;  ///< one per lamp, along its axes; zero without axes
};

}  // namespace occ::internal::identify
