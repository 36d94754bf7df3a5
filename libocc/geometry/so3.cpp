// SPDX-License-Identifier: Apache-2.0
#include "libocc/geometry/so3.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/internal/shortest_quaternion.hpp"

namespace occ {

namespace {

/// sin(t) / t
double sinc(double t) { return t == 0 ? 1 : std::sin(t) / t; }

/// (1 - cos t) / t^2, computed from the half angle to avoid cancellation
double versine_ratio(double t) {
  const double half = sinc(t / 2);
  return 0.5 * half * half;
}

/// (t - sin t) / t^3; by its series at small angles, where the difference cancels
double sine_defect_ratio(double t) {
  const double s = t * t;
  if (s > 1) return (t - std::sin(t)) / (s * t);
  double term = 1.0 / 6, sum = term;
  for (int k = 4; k <= 18; k += 2) {
    term *= -s / (k * (k + 1));
    sum += term;
  }
  return sum;
}

}  // namespace

Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

Eigen::Matrix3d so3_exp(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.stableNorm();
  const Eigen::Matrix3d cross = skew(rotation_rad);
  return Eigen::Matrix3d::Identity() + sinc(angle) * cross + versine_ratio(angle) * cross * cross;
}

Eigen::Vector3d so3_log(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);  // computed from its largest component: stable at pi
  const double sine = q.vec().stableNorm();
  if (sine == 0) return Eigen::Vector3d::Zero();
  const double sign = q.w() < 0 ? -1 : 1;
  return (2 * std::atan2(sine, std::abs(q.w())) * sign / sine) * q.vec();
}

Eigen::Matrix3d so3_left_jacobian(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.stableNorm();
  const Eigen::Matrix3d cross = skew(rotation_rad);
  return Eigen::Matrix3d::Identity() + versine_ratio(angle) * cross +
         sine_defect_ratio(angle) * cross * cross;
}

Eigen::Matrix3d shortest_rotation(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return internal::geometry::shortest_quaternion(from, to).toRotationMatrix();
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& m) {
  const auto svd =
      internal::core::jacobi_svd<Eigen::Matrix3d>(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) = -u.col(2);
  return u * svd.matrixV().transpose();
}

}  // namespace occ
