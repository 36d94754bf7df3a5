// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cmath>

#include "libocc/formation/rim.hpp"

namespace occ {
namespace {

// Sine of the smallest angle between the rim and the measured normal, in the lamp's plane, for
// which a distance along the normal is defined. Correct matches of discs and rectangles have larger
// angles up to 87 degrees of tilt.
constexpr double min_sine = 0.05;

using Jacobian16 = Eigen::Matrix<double, 1, 6>;

// Intersection P = range b of a ray b with a lamp's plane. When the measured point moves by one px
// along the measured normal, b moves by `across` and P by range * velocity.
struct Crossing {
  double inverse_cosine;  // 1 / (normal . b), negative on the lit side
  double range;
  Eigen::Vector3d from_centre;  // P - C [m]
  Eigen::Vector3d velocity;     // across - b (normal . across) / (normal . b)
};

std::optional<Crossing> cross_plane(const LampInCam& lamp, const RimRay& ray) {
  const double cosine = lamp.normal.dot(ray.bearing);
  const double height = lamp.normal.dot(lamp.centre_m);
  if (!(height < 0) || !(cosine < 0)) return std::nullopt;
  Crossing x;
  x.inverse_cosine = 1 / cosine;
  x.range = height * x.inverse_cosine;
  x.from_centre = x.range * ray.bearing - lamp.centre_m;
  x.velocity = ray.across - (lamp.normal.dot(ray.across) * x.inverse_cosine) * ray.bearing;
  return x;
}

// Value g of the intersection: zero on the rim, positive outside.
struct Distance {
  double value;              // metres, or any other unit
  Eigen::Vector3d gradient;  // in the plane, per metre
  double along;              // gradient . velocity, positive
  // Second derivative by the place in the lamp's frame, times the velocity.
  Eigen::Vector3d bend = Eigen::Vector3d::Zero();
};

bool is_defined(double along, double gradient2, const Crossing& x) {
  return along > 0 && along * along > min_sine * min_sine * gradient2 * x.velocity.squaredNorm();
}

std::optional<Distance> distance_from_circle(const LampInCam& lamp, const Crossing& x) {
  const double length = x.from_centre.norm();
  if (!(length > 0)) return std::nullopt;
  const Eigen::Vector3d outward = x.from_centre / length;
  const double along = outward.dot(x.velocity);
  if (!is_defined(along, 1, x)) return std::nullopt;
  return Distance{length - lamp.radius_m, outward, along, (x.velocity - along * outward) / length};
}

// Distance from the side that is nearest along the measured normal, of the sides through which the
// normal leaves. Near a corner, the nearest side may not be the measured one.
std::optional<Distance> distance_from_rectangle(const LampInCam& lamp, const Crossing& x) {
  std::optional<Distance> best;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d axis = i == 0 ? lamp.x_axis : lamp.normal.cross(lamp.x_axis);
    const double signed_along = axis.dot(x.velocity), along = std::abs(signed_along);
    if (!is_defined(along, 1, x)) continue;
    const Eigen::Vector3d outward = std::copysign(1.0, signed_along) * axis;
    const double metres = outward.dot(x.from_centre) - lamp.size_m[i] / 2;
    if (!best || std::abs(metres) * best->along < std::abs(best->value) * along) {
      best = Distance{metres, outward, along};
    }
  }
  return best;
}

// Distance from the side that is nearest along the measured normal, of those that it crosses from
// inside to outside, or whose line it crosses if there are none.
std::optional<Distance> distance_from_polygon(const LampInCam& lamp, const Crossing& x) {
  const Eigen::Vector3d y_axis = lamp.normal.cross(lamp.x_axis);
  const Eigen::Vector2d at(lamp.x_axis.dot(x.from_centre), y_axis.dot(x.from_centre));
  const Eigen::Vector2d moves(lamp.x_axis.dot(x.velocity), y_axis.dot(x.velocity));
  const std::size_t count = lamp.corners_m.size();
  std::optional<Distance> best;
  bool best_is_met = false;
  for (std::size_t i = 0; i < count; ++i) {
    constexpr double beyond = 0.05;  // of the side's length: errors of the pose
    const Eigen::Vector2d& from = lamp.corners_m[i];
    const Eigen::Vector2d side = lamp.corners_m[(i + 1) % count] - from;
    const double length = side.norm();
    const Eigen::Vector2d outward(side.y() / length, -side.x() / length);
    const double along = outward.dot(moves), metres = outward.dot(at - from);
    if (!is_defined(along, 1, x)) continue;
    const double share = (at - metres / along * moves - from).dot(side) / (length * length);
    const bool is_met = share > -beyond && share < 1 + beyond;
    if (best &&
        (best_is_met > is_met || (best_is_met == is_met &&
                                  std::abs(metres) * best->along >= std::abs(best->value) * along)))
      continue;
    best = Distance{metres, outward.x() * lamp.x_axis + outward.y() * y_axis, along};
    best_is_met = is_met;
  }
  return best;
}

// With u = |2x/a|, v = |2y/b| and the gauge G = (u^n + v^n)^(1/n), all derivatives are homogeneous:
// G_u = (u/G)^(n-1), G_uu = (n-1) (u/G)^(n-2) (v/G)^n / G, and G_uv = -(n-1) (u v / G^2)^(n-1) / G.
std::optional<Distance> distance_from_lame_curve(const LampInCam& lamp, const Crossing& x) {
  constexpr double smallest = 1e-6;  // for n < 2 the curvature on an axis is infinite
  const double n = lamp.exponent;
  const Eigen::Vector3d axes[] = {lamp.x_axis, lamp.normal.cross(lamp.x_axis)};
  Eigen::Vector2d size, sign;  // (u, v), and the derivatives of u and v by the place
  for (int i = 0; i < 2; ++i) {
    const double at = 2 * axes[i].dot(x.from_centre) / lamp.size_m[i];
    size[i] = std::max(std::abs(at), smallest);
    sign[i] = std::copysign(2 / lamp.size_m[i], at);
  }
  const double largest = size.maxCoeff();
  const double gauge = largest * std::pow((size / largest).array().pow(n).sum(), 1 / n);
  const Eigen::Array2d part = size.array() / gauge;
  const Eigen::Array2d slope = part.pow(n - 1) * sign.array();
  const Eigen::Vector3d gradient = slope[0] * axes[0] + slope[1] * axes[1];
  const double along = gradient.dot(x.velocity);
  if (!is_defined(along, gradient.squaredNorm(), x)) return std::nullopt;
  Distance out{gauge - 1, gradient, along};
  const Eigen::Vector2d moves(axes[0].dot(x.velocity), axes[1].dot(x.velocity));
  const double mixed = -slope[0] * slope[1];
  for (int i = 0; i < 2; ++i) {
    const double own = sign[i] * sign[i] * std::pow(part[i], n - 2) * std::pow(part[1 - i], n);
    out.bend += (n - 1) / gauge * (own * moves[i] + mixed * moves[1 - i]) * axes[i];
  }
  return out;
}

// d residual / d (rotation of the lamp about its centre, translation of its centre), for the
// residual g / (range u . v) with the gradient u and the velocity v. The derivatives of the range
// are n / (n . b) by the translation and -(P - C) / (n . b) by the normal. The derivative of v by
// the normal is -b v^T / (n . b).
Jacobian16 distance_jacobian(const LampInCam& lamp, const RimRay& ray, const Crossing& x,
                             const Distance& d) {
  const double inverse_scale = 1 / (x.range * d.along);
  const double residual = d.value * inverse_scale;
  const double u_b = d.gradient.dot(ray.bearing);
  const Eigen::Vector3d by_place = (residual * x.range) * d.bend;  // by the change of the gradient
  const double by_range = u_b - residual * d.along - by_place.dot(ray.bearing);
  Eigen::Vector3d by_translation = by_place - d.gradient;
  Eigen::Vector3d by_rotation = Eigen::Vector3d::Zero();
  if (lamp.shape != LampShape::disc) {
    // The gradient rotates with the lamp. A circle rotates about its axis only if its normal does.
    by_rotation = d.gradient.cross(x.from_centre - (residual * x.range) * x.velocity) +
                  x.from_centre.cross(by_place);
  }
  const Eigen::Vector3d by_normal =
      x.inverse_cosine * (residual * x.range * u_b * x.velocity - by_range * x.from_centre);
  by_translation += by_range * x.inverse_cosine * lamp.normal;
  by_rotation += lamp.normal.cross(by_normal);
  Jacobian16 jacobian;
  jacobian << by_rotation.transpose(), by_translation.transpose();
  return inverse_scale * jacobian;
}

std::optional<Distance> distance_from_rim(const LampInCam& lamp, const Crossing& x) {
  switch (lamp.shape) {
    case LampShape::disc:
      return distance_from_circle(lamp, x);
    case LampShape::rectangle:
      return distance_from_rectangle(lamp, x);
    case LampShape::lame:
      return distance_from_lame_curve(lamp, x);
    case LampShape::polygon:
      return distance_from_polygon(lamp, x);
    case LampShape::point:
      break;
  }
  return std::nullopt;
}

}  // namespace

std::optional<RimRay> rim_ray(const RimPoint& point, const Camera& camera) {
  Eigen::Matrix<double, 3, 2> d_px;
  const std::optional<Eigen::Vector3d> bearing = camera.unproject(point.px, &d_px);
  if (!bearing) return std::nullopt;
  RimRay ray{*bearing, d_px * point.normal, Eigen::Vector3d::Zero(), true};
  if (!camera.is_central()) {
    ray.origin = camera.ray(point.px)->origin;
    ray.central = false;
  }
  return ray;
}

LampInCam lamp_in_cam(const Lamp& lamp, const Rigid3& cam_from_world) {
  return {lamp.shape,
          cam_from_world * lamp.centre_m,
          cam_from_world.rotation * lamp.normal,
          cam_from_world.rotation * lamp.x_axis,
          lamp.radius_m,
          lamp.size_m,
          lamp.exponent,
          lamp.corners_m};
}

std::optional<double> rim_distance_px(const LampInCam& lamp, const RimRay& ray,
                                      Jacobian16* jacobian) {
  if (!has_rim_distance(lamp.shape)) return std::nullopt;
  if (!ray.central) {
    LampInCam from_origin = lamp;
    from_origin.centre_m -= ray.origin;
    RimRay own = ray;
    own.central = true;
    return rim_distance_px(from_origin, own, jacobian);
  }
  const std::optional<Crossing> crossing = cross_plane(lamp, ray);
  if (!crossing) return std::nullopt;
  const std::optional<Distance> distance = distance_from_rim(lamp, *crossing);
  if (!distance) return std::nullopt;
  if (jacobian) *jacobian = distance_jacobian(lamp, ray, *crossing, *distance);
  return distance->value / (crossing->range * distance->along);
}

std::optional<double> rim_distance_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                      const RimRay& ray, Jacobian16* jacobian) {
  const LampInCam in_cam = lamp_in_cam(lamp, cam_from_world);
  const std::optional<double> distance = rim_distance_px(in_cam, ray, jacobian);
  if (distance && jacobian) {
    const Eigen::Vector3d by_translation = jacobian->tail<3>().transpose();
    jacobian->head<3>() += in_cam.centre_m.cross(by_translation).transpose();
  }
  return distance;
}

}  // namespace occ
