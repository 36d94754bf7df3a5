// SPDX-License-Identifier: Apache-2.0
// Internal: the pose that best fits pairs of blobs and lamp centres, and how well it is known.
// Levenberg-Marquardt on directions; good enough to decide what belongs together, not a result.
#pragma once

#include "libocc/identify/internal/problem.hpp"

namespace occ::internal::identify {

struct Pair {
  int sighting = 0;
  int target = 0;
};

struct FittedPose {
  Rigid3 pose;  ///< camera from the local frame
  Matrix6 covariance;
  double chi2 = 0;
};

/// How a lamp's centre, `point` in the camera's frame, differs from a sighting.
struct Mismatch {
  Eigen::Vector2d error;                 ///< [rad]
  Eigen::Matrix<double, 2, 3> by_point;  ///< d error / d point
  Eigen::Matrix2d covariance;            ///< of the sighting, and for a lamp's centre not being its
                                         ///< image's centre
};

/// False when the point is not in front of the camera and on the sighting's side.
bool compare(const BearingObservation& sighting, const MapPoint& target,
             const Eigen::Matrix3d& rotation, const Eigen::Vector3d& point, Mismatch& mismatch);

/// How a pose fits, and how well its pairs determine it (to first order; finite even where they do
/// not).
FittedPose assess_pose(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                       const Rigid3& pose);

/// Best fit from `start`; three pairs suffice.
FittedPose fit_pose(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                    const Rigid3& start);

/// The same of pairs and the prior, if there is one: its chi-square counts, too.
FittedPose fit_pose_with_prior(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                               const Rigid3& start);

}  // namespace occ::internal::identify
