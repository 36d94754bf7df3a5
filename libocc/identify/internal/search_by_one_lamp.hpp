// SPDX-License-Identifier: Apache-2.0
// Internal: poses from the outline of one lamp, where fewer than three lamps match.
#pragma once

#include <vector>

#include "libocc/identify/internal/pose_hypothesis.hpp"

namespace occ::internal::identify {

/// A pose that the outline of one lamp allows.
struct LampPose {
  /// Camera from the axes of the world at the lamp's centre.
  Rigid3 pose;
  /// Inverse covariance of a rotation of the lamp about its centre and a translation of it [m].
  Matrix6 information;
  double chi2 = 0;
};

/// The pose in the local frame of a lamp whose centre is there.
FittedPose to_local(const LampPose& lamp, const Eigen::Vector3d& centre);

/// Result of one_lamp_poses().
struct OneLampPoses {
  std::vector<PoseHypothesis> hypotheses;
  std::vector<PoseCircle> circles;  ///< see Identification
};

/// All poses that the outline of one blob and one lamp allow, with the other blobs that match
/// there; those with the most pairs, by chi2 of the outlines. Mirror poses and turns that map a
/// lamp to itself are listed. A disc allows a circle of poses, of which a prior or the direction of
/// a second lamp selects one. Empty without outlines that determine a pose, and for cameras that
/// are not central.
/// `cut_short` becomes true if the search stopped at the deadline.
OneLampPoses one_lamp_poses(const AssignmentProblem& problem, bool& cut_short);

}  // namespace occ::internal::identify
