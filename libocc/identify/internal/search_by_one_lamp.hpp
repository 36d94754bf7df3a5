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
  /// Of a rotation of the lamp about its centre, and of a translation of the centre [m].
  Matrix6 covariance;
  double chi2 = 0;
};

/// All poses that the outline of one blob and one lamp allow, with the other blobs that match
/// there; those with the most pairs, by chi2 of the outlines. Mirror poses and turns that map a
/// lamp to itself are listed. Empty without outlines that determine a pose (those of discs and
/// ellipses do not), and for cameras that are not central.
std::vector<PoseHypothesis> one_lamp_hypotheses(const AssignmentProblem& problem);

}  // namespace occ::internal::identify
