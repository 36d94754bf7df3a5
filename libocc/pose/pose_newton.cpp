// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/pose_newton.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/bearing_basis.hpp"

namespace occ::internal::pose {
namespace {

inline Eigen::Vector3d point_from_origin(const Eigen::Matrix3Xd& points,
                                         const Eigen::Matrix3Xd& origins, const Rigid3& pose,
                                         Eigen::Index i) {
  // Written out: vector loads of a pose that was just stored as single numbers are slow.
  const double *r = pose.rotation.data(), *t = pose.translation.data();
  const double* p = points.data() + 3 * i;
  Eigen::Vector3d x(r[0] * p[0] + r[3] * p[1] + r[6] * p[2] + t[0],
                    r[1] * p[0] + r[4] * p[1] + r[7] * p[2] + t[1],
                    r[2] * p[0] + r[5] * p[1] + r[8] * p[2] + t[2]);
  if (origins.cols() > 0) x -= origins.col(i);
  return x;
}

// Step that minimises the residuals B x / |x| to first order; B: two rows orthogonal to a bearing.
template <int rows>
Vector6 newton_step(const Eigen::Matrix3Xd& bearings, const Eigen::Matrix3Xd& points,
                    const Eigen::Matrix3Xd& origins, const Rigid3& pose) {
  const Eigen::Index n = points.cols();
  Eigen::Matrix<double, rows, 6> jacobian(2 * n, 6);
  Eigen::Matrix<double, rows, 1> residual(2 * n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d x = point_from_origin(points, origins, pose, i);
    const Eigen::Vector3d rotated = pose.rotation * points.col(i);
    const TangentBasis across = tangent_basis(bearings.col(i)) / x.norm();
    residual.template segment<2>(2 * i) = -across * x;
    jacobian.template block<2, 3>(2 * i, 0) = -across * skew(rotated);
    jacobian.template block<2, 3>(2 * i, 3) = across;
  }
  if constexpr (rows == 6)
    return jacobian.partialPivLu().solve(residual);
  else
    return core::solve_pivoted_qr(jacobian, residual);
}

}  // namespace

double misfit_rad(const Eigen::Matrix3Xd& bearings, const Eigen::Matrix3Xd& points,
                  const Eigen::Matrix3Xd& origins, const Rigid3& pose) {
  double worst2 = 0;
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Eigen::Vector3d x = point_from_origin(points, origins, pose, i);
    const double* b = bearings.data() + 3 * i;
    const double along = b[0] * x[0] + b[1] * x[1] + b[2] * x[2];
    if (!(along > 0)) return std::numeric_limits<double>::infinity();
    const double off[3] = {x[0] - along * b[0], x[1] - along * b[1], x[2] - along * b[2]};
    const double tangent2 = (off[0] * off[0] + off[1] * off[1] + off[2] * off[2]) / (along * along);
    if (!(tangent2 <= worst2)) worst2 = tangent2;
  }
  return std::sqrt(worst2);
}

void polish_pose(const Eigen::Matrix3Xd& bearings, const Eigen::Matrix3Xd& points,
                 const Eigen::Matrix3Xd& origins, int max_steps, Rigid3& pose) {
  // At the level of rounding the misfit no longer ranks poses; one more step is then the last. The
  // same holds after a step as small as the root of rounding, because the remaining error is its
  // square.
  constexpr double rounding = 5e-16;
  double misfit = misfit_rad(bearings, points, origins, pose);
  bool last = false;
  for (int i = 0; i < max_steps && !last; ++i) {
    const Vector6 step = points.cols() == 3
                             ? newton_step<6>(bearings, points, origins, pose)
                             : newton_step<Eigen::Dynamic>(bearings, points, origins, pose);
    last = misfit < rounding || step.squaredNorm() < rounding;
    // The rotation is about the points' origin, so the translation is not rotated.
    const Rigid3 moved{so3_exp(step.head<3>()) * pose.rotation, pose.translation + step.tail<3>()};
    const double after = misfit_rad(bearings, points, origins, moved);
    if (!(after < std::max(misfit, rounding))) return;
    misfit = after;
    pose = moved;
  }
}

}  // namespace occ::internal::pose
