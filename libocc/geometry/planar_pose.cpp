// SPDX-License-Identifier: Apache-2.0
#include "libocc/geometry/planar_pose.hpp"

#include <cmath>

#include "libocc/core/math.hpp"

namespace occ {
namespace {

/// sin(a) / a, the ratio of chord and length of an arc that turns by 2 a.
double chord_per_arc(double a) { return std::abs(a) < 1e-8 ? 1 : std::sin(a) / a; }

}  // namespace

Eigen::Vector2d PlanarPose::forward() const {
  return {std::cos(heading_rad), std::sin(heading_rad)};
}

Eigen::Vector2d PlanarPose::left() const { return {-std::sin(heading_rad), std::cos(heading_rad)}; }

Eigen::Vector2d PlanarPose::operator*(const Eigen::Vector2d& point) const {
  return position() + point.x() * forward() + point.y() * left();
}

PlanarPose PlanarPose::operator*(const PlanarPose& increment) const {
  const Eigen::Vector2d to = *this * increment.position();
  return {to.x(), to.y(), wrapped_rad(heading_rad + increment.heading_rad)};
}

PlanarPose PlanarPose::inverse() const {
  return {-position().dot(forward()), -position().dot(left()), wrapped_rad(-heading_rad)};
}

bool PlanarPose::finite() const {
  return std::isfinite(x_m) && std::isfinite(y_m) && std::isfinite(heading_rad);
}

double wrapped_rad(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2 * pi);
  return wrapped > -pi ? wrapped : pi;
}

Eigen::Vector3d difference(const PlanarPose& to, const PlanarPose& from) {
  return {to.x_m - from.x_m, to.y_m - from.y_m, wrapped_rad(to.heading_rad - from.heading_rad)};
}

PlanarPose arc(double length_m, double turn_rad) { return planar_exp({length_m, 0, turn_rad}); }

PlanarPose planar_exp(const Eigen::Vector3d& motion) {
  const double half = motion[2] / 2;
  const Eigen::Vector2d chord = chord_per_arc(half) * motion.head<2>();
  const double c = std::cos(half), s = std::sin(half);
  return {c * chord.x() - s * chord.y(), s * chord.x() + c * chord.y(), wrapped_rad(motion[2])};
}

Eigen::Vector3d planar_log(const PlanarPose& pose) {
  const double turn = wrapped_rad(pose.heading_rad), half = turn / 2;
  const Eigen::Vector2d chord = pose.position() / chord_per_arc(half);
  const double c = std::cos(half), s = std::sin(half);
  return {c * chord.x() + s * chord.y(), -s * chord.x() + c * chord.y(), turn};
}

Rigid3 body_from_world(const PlanarPose& pose, double height_m) {
  Rigid3 body;
  body.rotation << pose.forward().x(), pose.forward().y(), 0, pose.left().x(), pose.left().y(), 0,
      0, 0, 1;
  body.translation = -(body.rotation * Eigen::Vector3d(pose.x_m, pose.y_m, height_m));
  return body;
}

PlanarPose planar_pose(const Rigid3& body_from_world) {
  const Eigen::Vector3d origin = body_from_world.origin_in_source();
  const Eigen::Vector3d forward = body_from_world.rotation.row(0);
  return {origin.x(), origin.y(), std::atan2(forward.y(), forward.x())};
}

}  // namespace occ
