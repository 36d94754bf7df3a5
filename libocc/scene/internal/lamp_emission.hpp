// SPDX-License-Identifier: Apache-2.0
// Emission of a lamp for many directions: Lambertian (radiometry/lambertian.hpp) or from its
// photometry (radiometry/emission_profile.hpp).
#pragma once

#include <Eigen/Core>
#include <memory>

#include "libocc/radiometry/lambertian.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ::internal::scene {

/// Directions and gradients are in the frame `rotation` * world. `cos_emission` is the cosine of
/// the angle between the direction and the lamp's normal.
class LampEmission {
 public:
  /// Keeps the lamp's photometry, not the lamp.
  explicit LampEmission(const Lamp& lamp,
                        const Eigen::Matrix3d& rotation = Eigen::Matrix3d::Identity());

  /// Radiant intensity [W/sr] of `power_w`; the direction may have any length.
  double intensity(double power_w, const Eigen::Vector3d& direction, double cos_emission) const {
    if (!profile_) return radiant_intensity(power_w, order_, cos_emission);
    return cos_emission > 0 ? power_w * density(direction) : 0;
  }

  /// Radiance [W/(m^2 sr)] of a flat source of `power_w`; 0 only behind its plane. With photometry,
  /// cosines below 0.01 are replaced by 0.01, where measured light at 90 degrees would give an
  /// infinite radiance.
  double radiance(double power_w, double area_m2, const Eigen::Vector3d& direction,
                  double cos_emission) const;

  /// Power [W] through an aperture, as aperture_power().
  double aperture_power(double power_w, const Eigen::Vector3d& direction, double cos_emission,
                        double cos_incidence, double distance_m, double area_m2) const;

  /// Derivative of ln(intensity) by a unit direction, perpendicular to it. Zero without light.
  Eigen::Vector3d log_gradient(const Eigen::Vector3d& direction) const;

  bool has_profile() const { return profile_ != nullptr; }
  /// Lamp::order().
  double order() const { return order_; }

 private:
  double density(const Eigen::Vector3d& direction) const;

  std::shared_ptr<const EmissionProfile> profile_;
  double order_;
  Eigen::Vector3d normal_;
  Eigen::Matrix3d to_lamp_ = Eigen::Matrix3d::Identity();  // rows: axes of EmissionProfile
};

}  // namespace occ::internal::scene
