// SPDX-License-Identifier: Apache-2.0
// Maximum-likelihood pose from points and their observed bearings, from an initial pose.
//
// Residuals are in the plane that touches the unit sphere at the bearing, r = A x / (f . x), with
// the point x in the camera frame, its bearing f, and two rows A orthogonal to f, divided by the
// sigmas. This suits any central camera or rig and any field of view. Gauss-Newton, followed if
// necessary by Levenberg-Marquardt (core/internal/least_squares.hpp).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/pose/solver.hpp"

namespace occ::internal::pose {

/// Points with their observed bearings, stored in blocks of four.
class LIBOCC_API SeenPoints {
 public:
  using Four = Eigen::Array<double, 4, 1>;

  struct Block {
    Four point[3];      ///< X, world
    Four bearing[3];    ///< f
    Four across[2][3];  ///< A
    Four offset[2];     ///< A o with the start o of the bearing
    Four along;         ///< f . o
  };

  void reserve(int count);

  /// `across`: two rows orthogonal to the bearing, times the inverse of a square root of the
  /// direction's covariance; `origin`: start of the bearing, camera frame.
  void add(const Eigen::Vector3d& point, const Eigen::Vector3d& bearing,
           const Eigen::Matrix<double, 2, 3>& across,
           const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

  /// Adds point i of `other`.
  void add(const SeenPoints& other, int i);

  int count() const { return count_; }
  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  void append(const Eigen::Vector3d& point, const Eigen::Vector3d& bearing,
              const Eigen::Matrix<double, 2, 3>& across, const Eigen::Vector2d& offset,
              double along);

  std::vector<Block> blocks_;
  int count_ = 0;
};

/// The points of a problem, with a sigma of 1 rad for every direction.
LIBOCC_API SeenPoints seen_along(const PoseProblem& problem);

/// Normal equations J^T J, J^T r, r^T r for a rotation about the origin of the *points'* frame,
/// followed by a translation, both along the camera's axes. They are nearly uncorrelated if that
/// origin is among the points.
struct PointEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double chi2 = 0;  ///< infinite when a point is not in front
};

LIBOCC_API PointEquations point_equations(const SeenPoints& seen, const Rigid3& pose);
LIBOCC_API double point_chi2(const SeenPoints& seen, const Rigid3& pose);

/// J^T r with the Jacobian J at `base` and the residuals r at `pose`; NaN when a point is not in
/// front.
Vector6 residual_along(const SeenPoints& seen, const Rigid3& base, const Rigid3& pose);

/// Writes chi2 of each point to `chi2`; infinite for points that are not in front.
LIBOCC_API void each_chi2(const SeenPoints& seen, const Rigid3& pose, std::vector<double>& chi2);

struct PointFit {
  Rigid3 pose;
  PointEquations equations;  ///< at the pose
  int iterations = 0;
  bool converged = false;
};

/// Points should be about their frame's origin, in units of their size. `tolerance`: Mahalanobis
/// length [sigmas] of the remaining step; rounding of chi2 limits it.
LIBOCC_API PointFit fit_points(const SeenPoints& seen, const Rigid3& start, int max_iterations,
                               double tolerance);

}  // namespace occ::internal::pose
