// SPDX-License-Identifier: Apache-2.0
// Internal: the most likely pose for points seen along bearings, from a start. Residuals are taken
// in the plane that touches the unit sphere at the bearing, r = A x / (f . x), x the point in the
// camera's frame, f its bearing, A two rows across f over the sigmas: any central camera or rig,
// any field of view. Gauss-Newton steps, and
// Levenberg-Marquardt steps (core/internal/least_squares.hpp) where one of them fails.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::pose {

/// Points and what was seen of them, four to a block.
class LIBOCC_API SeenPoints {
 public:
  using Four = Eigen::Array<double, 4, 1>;

  struct Block {
    Four point[3];      ///< X, world
    Four bearing[3];    ///< f
    Four across[2][3];  ///< A
    Four offset[2];     ///< A o, o where the bearing starts
    Four along;         ///< f . o
  };

  void reserve(int count);

  /// `across`: two rows orthogonal to the bearing, times the inverse of a square root of the
  /// direction's covariance; `origin`: where the bearing starts, camera frame.
  void add(const Eigen::Vector3d& point, const Eigen::Vector3d& bearing,
           const Eigen::Matrix<double, 2, 3>& across,
           const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

  /// One of another's.
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

/// J^T J, J^T r, r^T r for a turn about the origin of the *points'* frame, then a shift, both along
/// the camera's axes: nearly uncorrelated when that origin is among the points.
struct PointEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double chi2 = 0;  ///< infinite when a point is not in front
};

LIBOCC_API PointEquations point_equations(const SeenPoints& seen, const Rigid3& pose);
LIBOCC_API double point_chi2(const SeenPoints& seen, const Rigid3& pose);

/// Of each point alone, in `chi2`; infinite for those that are not in front.
LIBOCC_API void each_chi2(const SeenPoints& seen, const Rigid3& pose, std::vector<double>& chi2);

struct PointFit {
  Rigid3 pose;
  PointEquations equations;  ///< at the pose
  int iterations = 0;
  bool converged = false;
};

/// Points should lie about their frame's origin, in units of their size. `tolerance`: the step in
/// sigmas (its Mahalanobis length) that is left; rounding of chi2 is a limit to it.
LIBOCC_API PointFit fit_points(const SeenPoints& seen, const Rigid3& start, int max_iterations,
                               double tolerance);

}  // namespace occ::internal::pose
