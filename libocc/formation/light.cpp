// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/light.hpp"

#include <Eigen/Geometry>

#include "libocc/radiometry/lambertian.hpp"
#include "libocc/scene/internal/lamp_emission.hpp"

namespace occ {

using internal::scene::LampEmission;

double aperture_m2(const Camera& camera, const Sensor& sensor) {
  constexpr double quarter_pi = 0.7853981633974483;
  const double diameter_squared = camera.fx_px() * camera.fy_px() * sensor.pixel_pitch_m *
                                  sensor.pixel_pitch_m / (sensor.f_number * sensor.f_number);
  return quarter_pi * diameter_squared;
}

double irradiance_of_radiance(double radiance, const Camera& camera, const Sensor& sensor,
                              const Eigen::Vector3d& bearing, double solid_angle_sr) {
  const double pixel_m2 = sensor.pixel_pitch_m * sensor.pixel_pitch_m;
  return radiance * aperture_m2(camera, sensor) * camera.depth_m(bearing) * solid_angle_sr /
         pixel_m2;
}

LampIrradiance::LampIrradiance(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                               const Sensor& sensor)
    : lamp_(lamp),
      camera_(camera),
      normal_(cam_from_world.rotation * lamp.normal),
      order_(lamp.order()),
      area_m2_(lamp.area_m2()),
      per_radiance_(aperture_m2(camera, sensor) / (sensor.pixel_pitch_m * sensor.pixel_pitch_m)),
      measured_(lamp.photometry
                    ? std::make_shared<const LampEmission>(lamp, cam_from_world.rotation)
                    : nullptr),
      shines_((cam_from_world * lamp.centre_m).dot(normal_) < 0) {}

double LampIrradiance::at(const Eigen::Vector2d& px) const {
  if (!shines_) return 0;
  Eigen::Matrix<double, 3, 2> jacobian;
  const auto bearing = camera_.unproject(px, &jacobian);
  if (!bearing) return 0;
  const double cos_emission = -bearing->dot(normal_);
  const double l = measured_ ? measured_->radiance(lamp_.power_w, area_m2_, -*bearing, cos_emission)
                             : radiance(lamp_.power_w, order_, area_m2_, cos_emission);
  return l * per_radiance_ * camera_.depth_m(*bearing) *
         jacobian.col(0).cross(jacobian.col(1)).norm();
}

double irradiance_at(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                     const Sensor& sensor, const Eigen::Vector2d& px) {
  return LampIrradiance(lamp, cam_from_world, camera, sensor).at(px);
}

Eigen::Vector2d log_irradiance_gradient(const Lamp& lamp, const Rigid3& cam_from_world,
                                        const Camera& camera, const Sensor& sensor,
                                        const Eigen::Vector2d& px) {
  Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  if (lamp.shape == LampShape::point) return gradient;
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::Vector2d half = 0.5 * Eigen::Vector2d::Unit(axis);
    const double above = irradiance_at(lamp, cam_from_world, camera, sensor, px + half);
    const double below = irradiance_at(lamp, cam_from_world, camera, sensor, px - half);
    if (!(above > 0 && below > 0)) return Eigen::Vector2d::Zero();
    gradient[axis] = std::log(above / below);
  }
  return gradient;
}

double lamp_electrons(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                      const Sensor& sensor, Eigen::Matrix<double, 1, 6>* log_jacobian) {
  if (log_jacobian) log_jacobian->setZero();
  const Eigen::Vector3d centre = cam_from_world * lamp.centre_m;
  const Eigen::Vector3d normal = cam_from_world.rotation * lamp.normal;
  const double height = -centre.dot(normal);  // distance of the camera from the lamp's plane
  Eigen::Vector3d by_centre;
  const double depth = camera.depth_m(centre, &by_centre);
  if (!(height > 0 && depth > 0)) return 0;

  const double distance = centre.norm();
  const LampEmission emission(lamp, cam_from_world.rotation);
  const double power_w =
      emission.aperture_power(lamp.power_w, -centre, height / distance, depth / distance, distance,
                              aperture_m2(camera, sensor));
  if (log_jacobian && (power_w > 0 || !emission.has_profile())) {
    // ln P = ln I + ln(depth) - 3 ln(distance) + constant, and for a Lambertian lamp
    // ln I = m ln(height) - m ln(distance) + constant; a rotation changes only the depth.
    const Eigen::Vector3d by_rotation = centre.cross(by_centre) / depth;
    const double order = emission.order();
    Eigen::Vector3d by_translation;
    if (emission.has_profile())
      by_translation = -emission.log_gradient(-centre / distance) / distance + by_centre / depth -
                       3 / (distance * distance) * centre;
    else
      by_translation = -order / height * normal + by_centre / depth -
                       (order + 3) / (distance * distance) * centre;
    *log_jacobian << by_rotation.transpose(), by_translation.transpose();
  }
  const double pixel_m2 = sensor.pixel_pitch_m * sensor.pixel_pitch_m;
  return sensor.electrons(power_w / pixel_m2) - sensor.electrons(0);
}

}  // namespace occ
