// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cmath>

#include "libocc/formation/rim.hpp"

namespace occ {
namespace {

/// Sine of the smallest angle between rim and measured normal, in the lamp's plane, at which a
/// distance along the normal still means something. A correct match of a disc or rectangle stays
/// above it up to 87 degrees of tilt.
constexpr double min_sine = 0.05;

using Jacobian16 = Eigen::Matrix<double, 1, 6>;

/// Where a ray b meets a lamp's plane: P = range b. As the measured point moves one px along the
/// measured normal, b moves by `across` and P by range velocity.
struct Crossing {
  double cosine;  // normal . b, negative on the lit side
  double slide;   // (normal . across) / cosine
  double range;
  Eigen::Vector3d from_centre;  // P - C [m]
  Eigen::Vector3d velocity;     // across - slide b
};

std::optional<Crossing> cross_plane(const LampInCam& lamp, const RimRay& ray) {
  Crossing x;
  x.cosine = lamp.normal.dot(ray.bearing);
  const double height = lamp.normal.dot(lamp.centre_m);
  if (!(height < 0) || !(x.cosine < 0)) return std::nullopt;
  x.slide = lamp.normal.dot(ray.across) / x.cosine;
  x.range = height / x.cosine;
  x.from_centre = x.range * ray.bearing - lamp.centre_m;
  x.velocity = ray.across - x.slide * ray.bearing;
  return x;
}

/// Signed distance of the crossing from the rim.
struct Distance {
  double metres;
  Eigen::Vector3d outward;  // its gradient in the plane, unit
  double along;             // outward . velocity, positive
  double curvature;         // 1/|P - C| of a circle, 0 of a straight side
};

std::optional<Distance> distance_from_circle(const LampInCam& lamp, const Crossing& x) {
  const double length = x.from_centre.norm();
  if (!(length > 0)) return std::nullopt;
  const Eigen::Vector3d outward = x.from_centre / length;
  const double along = outward.dot(x.velocity);
  if (!(along > min_sine * x.velocity.norm())) return std::nullopt;
  return Distance{length - lamp.radius_m, outward, along, 1 / length};
}

/// Of the sides by which the measured normal leaves, the one it meets soonest: near a corner the
/// nearest side need not be the one that was measured.
std::optional<Distance> distance_from_rectangle(const LampInCam& lamp, const Crossing& x) {
  const double least = min_sine * x.velocity.norm();
  std::optional<Distance> best;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d axis = i == 0 ? lamp.x_axis : lamp.normal.cross(lamp.x_axis);
    const double signed_along = axis.dot(x.velocity), along = std::abs(signed_along);
    if (!(along > least)) continue;
    const Eigen::Vector3d outward = std::copysign(1.0, signed_along) * axis;
    const double metres = outward.dot(x.from_centre) - lamp.size_m[i] / 2;
    if (!best || std::abs(metres) * best->along < std::abs(best->metres) * along) {
      best = Distance{metres, outward, along, 0};
    }
  }
  return best;
}

/// d (metres / scale) / d pose with scale = range (outward . velocity). The perturbation (w, t)
/// moves the lamp's centre C by w x C + t and turns its normal n by w x n; the ray stays.
Jacobian16 distance_jacobian(const LampInCam& lamp, const RimRay& ray, const Crossing& x,
                             const Distance& d, double scale) {
  // range = (n . C) / (n . b)
  Jacobian16 d_range;
  d_range << -x.range / x.cosine * lamp.normal.cross(ray.bearing).transpose(),
      lamp.normal.transpose() / x.cosine;

  // metres = g(P - C) with dP = b d(range)
  const double bearing_outward = d.outward.dot(ray.bearing);
  Jacobian16 d_metres = bearing_outward * d_range;
  d_metres.head<3>() -= lamp.centre_m.cross(d.outward).transpose();
  d_metres.tail<3>() -= d.outward.transpose();

  // velocity = a - b (n . a) / (n . b)
  Jacobian16 d_scale = d.along * d_range;
  const Eigen::Vector3d d_slide =
      (lamp.normal.cross(ray.across) - x.slide * lamp.normal.cross(ray.bearing)) / x.cosine;
  d_scale.head<3>() -= x.range * bearing_outward * d_slide.transpose();
  if (d.curvature > 0) {
    // a circle's outward direction u turns with P - C: du = (I - u u^T) d(P - C) / |P - C|
    const Eigen::Vector3d turn = x.range * d.curvature * (x.velocity - d.along * d.outward);
    d_scale += turn.dot(ray.bearing) * d_range;
    d_scale.head<3>() -= lamp.centre_m.cross(turn).transpose();
    d_scale.tail<3>() -= turn.transpose();
  } else {
    // a side's turns with the lamp: du = w x u
    d_metres.head<3>() += d.outward.cross(x.from_centre).transpose();
    d_scale.head<3>() += x.range * d.outward.cross(x.velocity).transpose();
  }
  return (d_metres - d.metres / scale * d_scale) / scale;
}

}  // namespace

std::optional<RimRay> rim_ray(const RimPoint& point, const Camera& camera) {
  Eigen::Matrix<double, 3, 2> d_px;
  const std::optional<Eigen::Vector3d> bearing = camera.unproject(point.px, &d_px);
  if (!bearing) return std::nullopt;
  return RimRay{*bearing, d_px * point.normal};
}

LampInCam lamp_in_cam(const Lamp& lamp, const Rigid3& cam_from_world) {
  return {lamp.shape,
          cam_from_world * lamp.centre_m,
          cam_from_world.rotation * lamp.normal,
          cam_from_world.rotation * lamp.x_axis,
          lamp.radius_m,
          lamp.size_m};
}

std::optional<double> rim_distance_px(const LampInCam& lamp, const RimRay& ray,
                                      Jacobian16* jacobian) {
  if (lamp.shape == LampShape::point) return std::nullopt;
  const std::optional<Crossing> crossing = cross_plane(lamp, ray);
  if (!crossing) return std::nullopt;
  const std::optional<Distance> distance = lamp.shape == LampShape::disc
                                               ? distance_from_circle(lamp, *crossing)
                                               : distance_from_rectangle(lamp, *crossing);
  if (!distance) return std::nullopt;
  const double scale = crossing->range * distance->along;
  if (jacobian) *jacobian = distance_jacobian(lamp, ray, *crossing, *distance, scale);
  return distance->metres / scale;
}

std::optional<double> rim_distance_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                      const RimRay& ray, Jacobian16* jacobian) {
  return rim_distance_px(lamp_in_cam(lamp, cam_from_world), ray, jacobian);
}

}  // namespace occ
