// SPDX-License-Identifier: Apache-2.0
// Least-squares pose from pairs of bearing observations and map points, with its covariance.
//
// Minimises the sum of e' S^-1 e (assignment_problem.hpp), with the chi-square of the prior where
// requested, by the Levenberg-Marquardt method. The model is coarse: a lamp's centre is compared
// with the centroid of its blob. It decides which pairs are consistent; libocc/refine computes the
// final pose.
#pragma once

#include "libocc/identify/internal/assignment_problem.hpp"

namespace occ::internal::identify {

/// A correspondence: indices of an observation and of a map point.
struct Pair {
  int observation = 0;
  int map_point = 0;
};

struct FittedPose {
  Rigid3 pose;  ///< camera from the local frame
  Matrix6 covariance;
  double chi2 = 0;
};

/// Residual of a map point against an observation.
struct Mismatch {
  Eigen::Vector2d error;                 ///< e [rad]
  Eigen::Matrix<double, 2, 3> by_point;  ///< derivative of e by the point in the camera frame
  Eigen::Matrix2d covariance;  ///< S: covariance of the observation, plus the squared offset
                               ///< between the centre of a disc and the centre of its image
};

/// Computes the residual of a point in the camera frame. Returns false when the point is not in
/// front of the camera or not on the side of the bearing.
bool compare(const BearingObservation& observation, const MapPoint& map_point,
             const Eigen::Matrix3d& rotation, const Eigen::Vector3d& point, Mismatch& mismatch);

/// Chi-square and first-order covariance of the pairs at a fixed pose. The covariance stays finite
/// where the pairs do not determine the pose.
FittedPose assess_pose(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                       const Rigid3& pose);

/// Fits the pose to at least three pairs, starting from `start`.
FittedPose fit_pose(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                    const Rigid3& start);

/// Fits the pose to the pairs and the prior, if there is one; chi2 includes the prior.
FittedPose fit_pose_with_prior(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                               const Rigid3& start);

}  // namespace occ::internal::identify
