// SPDX-License-Identifier: Apache-2.0
#include "libocc/camera/internal/distortion.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/camera/internal/polynomial.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::camera {

namespace {

/// Radial factor and its derivative by s = r^2.
struct Radial {
  double factor, slope;
};

Radial radial_at(const DistortionCoefficients& k, double s) {
  const double above = 1 + s * (k[0] + s * (k[1] + s * k[4]));
  const double below = 1 + s * (k[5] + s * (k[6] + s * k[7]));
  const double above_slope = k[0] + s * (2 * k[1] + s * 3 * k[4]);
  const double below_slope = k[5] + s * (2 * k[6] + s * 3 * k[7]);
  const double factor = above / below;
  return {factor, (above_slope - factor * below_slope) / below};
}

/// Inverse of the radial part of the distortion, at most the domain's edge. Newton's method inside
/// a bracket; the radial part grows throughout the domain.
double undistorted_radius(const DistortionCoefficients& k, double max_radius, double distorted) {
  double low = 0, high = max_radius;
  double r = distorted < high ? distorted : low + (high - low) / 2;
  for (int i = 0; i < 100; ++i) {
    const auto [factor, slope] = radial_at(k, r * r);
    const double error = r * factor - distorted;
    (error < 0 ? low : high) = r;
    if (std::abs(error) <= 1e-15 * distorted) break;
    const double next = r - error / (factor + 2 * r * r * slope);
    const double middle = high < infinity ? low + (high - low) / 2 : 2 * low;
    const double before = std::exchange(r, next > low && next < high ? next : middle);
    if (r == before) break;
  }
  return r;
}

}  // namespace

Eigen::Vector2d distort(const DistortionCoefficients& k, const Eigen::Vector2d& undistorted,
                        Eigen::Matrix2d* jacobian) {
  const double x = undistorted.x(), y = undistorted.y();
  const double s = x * x + y * y;
  const auto [factor, slope] = radial_at(k, s);
  const double p1 = k[2], p2 = k[3];
  if (jacobian) {
    const double prism_x = 2 * (k[8] + 2 * s * k[9]), prism_y = 2 * (k[10] + 2 * s * k[11]);
    const double mixed = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y;
    *jacobian << factor + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x + prism_x * x,
        mixed + prism_x * y, mixed + prism_y * x,
        factor + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x + prism_y * y;
  }
  return {x * factor + 2 * p1 * x * y + p2 * (s + 2 * x * x) + s * (k[8] + s * k[9]),
          y * factor + p1 * (s + 2 * y * y) + 2 * p2 * x * y + s * (k[10] + s * k[11])};
}

double domain_radius_squared(const DistortionCoefficients& k) {
  // d(r above/below)/dr has the sign of above below + 2 s (above' below - above below').
  const Polynomial above{1, k[0], k[1], k[4]}, below{1, k[5], k[6], k[7]};
  const Polynomial wronskian =
      sum(product(derivative(above), below), -1, product(above, derivative(below)));
  const Polynomial growth = sum(product(above, below), 2, product({0, 1}, wronskian));
  constexpr double limit = 1e12;  // r = 1e6: within 1e-6 rad of a right angle
  double first = infinity;
  for (const Polynomial& p :
       {growth, below}) {  // a zero of `below` is a pole and ends the domain too
    const std::vector<double> roots = sign_changes(p, limit);
    if (!roots.empty()) first = std::min(first, roots.front());
  }
  return first;
}

std::optional<Eigen::Vector2d> undistort(const DistortionCoefficients& k, double max_radius_squared,
                                         const Eigen::Vector2d& distorted) {
  const double radius = distorted.norm();
  if (!(radius < infinity)) return std::nullopt;
  if (radius == 0) return distorted;
  const double start = undistorted_radius(k, std::sqrt(max_radius_squared), radius);
  Eigen::Vector2d point = distorted * (start * (1 - 1e-12) / radius);  // inside the domain's edge
  const double enough = 1e-13 * (1 + radius);
  double before = infinity;
  for (int i = 0; i < 60; ++i) {  // slow near the domain's edge, where the root is nearly double
    Eigen::Matrix2d jacobian;
    const Eigen::Vector2d error = distort(k, point, &jacobian) - distorted;
    const double size = error.norm();
    if (size <= enough && size >= 0.1 * before) break;  // only rounding is left
    before = size;
    Eigen::Vector2d step = jacobian.inverse() * error;
    for (int j = 0; j < 64 && !((point - step).squaredNorm() < max_radius_squared); ++j) step /= 2;
    point -= step;
  }
  const bool inside = point.squaredNorm() < max_radius_squared;
  if (!(inside && (distort(k, point) - distorted).norm() <= enough)) return std::nullopt;
  return point;
}

Eigen::Matrix<double, 2, 12> distort_by_coefficients(const DistortionCoefficients& k,
                                                     const Eigen::Vector2d& undistorted) {
  const double x = undistorted.x(), y = undistorted.y();
  const double s = x * x + y * y;
  const double below = 1 + s * (k[5] + s * (k[6] + s * k[7]));
  const double factor = radial_at(k, s).factor;
  Eigen::Matrix<double, 2, 12> d;
  d.setZero();
  const Eigen::Vector2d up = undistorted / below, down = -factor * up;
  d.col(0) = s * up;
  d.col(1) = s * s * up;
  d.col(4) = s * s * s * up;
  d.col(5) = s * down;
  d.col(6) = s * s * down;
  d.col(7) = s * s * s * down;
  d.col(2) << 2 * x * y, s + 2 * y * y;
  d.col(3) << s + 2 * x * x, 2 * x * y;
  d(0, 8) = d(1, 10) = s;
  d(0, 9) = d(1, 11) = s * s;
  return d;
}

namespace {

/// Projection of the turned plane onto the tilted sensor, linear in the rotation.
Eigen::Matrix3d onto_sensor(const Eigen::Matrix3d& rotation, double last) {
  Eigen::Matrix3d onto;
  onto << rotation(2, 2), 0, -rotation(0, 2), 0, rotation(2, 2), -rotation(1, 2), 0, 0, last;
  return onto;
}

}  // namespace

Eigen::Matrix3d tilt_homography(double tau_x_rad, double tau_y_rad) {
  const Eigen::Matrix3d rotation = (Eigen::AngleAxisd(-tau_y_rad, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(-tau_x_rad, Eigen::Vector3d::UnitX()))
                                       .toRotationMatrix();
  return onto_sensor(rotation, 1) * rotation;
}

Eigen::Matrix2d tilt_by_angles(double tau_x_rad, double tau_y_rad, const Eigen::Vector2d& point) {
  const Eigen::Matrix3d about_x =
      Eigen::AngleAxisd(-tau_x_rad, Eigen::Vector3d::UnitX()).toRotationMatrix();
  const Eigen::Matrix3d about_y =
      Eigen::AngleAxisd(-tau_y_rad, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Matrix3d rotation = about_y * about_x;
  Eigen::Matrix3d cross_x, cross_y;
  cross_x << 0, 0, 0, 0, 0, -1, 0, 1, 0;
  cross_y << 0, 0, 1, 0, 0, 0, -1, 0, 0;
  const Eigen::Matrix3d d_rotation[] = {-about_y * cross_x * about_x, -cross_y * rotation};
  const Eigen::Vector3d v = onto_sensor(rotation, 1) * rotation * point.homogeneous();
  Eigen::Matrix2d d;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d dv =
        (onto_sensor(d_rotation[i], 0) * rotation + onto_sensor(rotation, 1) * d_rotation[i]) *
        point.homogeneous();
    d.col(i) = (dv.head<2>() - v.head<2>() / v.z() * dv.z()) / v.z();
  }
  return d;
}

}  // namespace occ::internal::camera
