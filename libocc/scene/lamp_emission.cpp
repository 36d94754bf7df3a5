// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/lamp_emission.hpp"

#include <Eigen/Geometry>
#include <algorithm>

#include "libocc/core/require.hpp"
#include "libocc/radiometry/emission_profile.hpp"

namespace occ::internal::scene {
namespace {

// The normal is unit. An x_axis that is not orthogonal to it comes from a lamp that was not
// validated.
Eigen::Matrix3d axes_of_profile(const Lamp& lamp) {
  const Eigen::Vector3d normal = lamp.normal.normalized();
  Eigen::Vector3d x = lamp.x_axis - lamp.x_axis.dot(normal) * normal;
  if (!(x.norm() > 1e-9)) x = normal.unitOrthogonal();
  x.normalize();
  Eigen::Matrix3d rows;
  rows << x.transpose(), x.cross(normal).transpose(), normal.transpose();
  return rows;
}

}  // namespace

LampEmission::LampEmission(const Lamp& lamp, const Eigen::Matrix3d& rotation)
    : profile_(lamp.photometry), order_(lamp.order()), normal_(rotation * lamp.normal) {
  if (profile_) to_lamp_ = axes_of_profile(lamp) * rotation.transpose();
}

double LampEmission::density(const Eigen::Vector3d& direction) const {
  return profile_->density(to_lamp_ * direction.normalized());
}

double LampEmission::radiance(double power_w, double area_m2, const Eigen::Vector3d& direction,
                              double cos_emission) const {
  if (!profile_) return occ::radiance(power_w, order_, area_m2, cos_emission);
  if (!(area_m2 > 0)) require(false, "area_m2", area_m2, "positive");
  if (!(cos_emission > 0)) return 0;
  constexpr double grazing_cos = 0.01;  // as for Lambertian lamps of order below 1
  // Zero stands for a ray that does not meet the lit side, so a dark direction has a radiance that
  // no sensor detects.
  constexpr double dark_share = 1e-12;
  return std::max(intensity(power_w, direction, cos_emission), dark_share * power_w) /
         (area_m2 * std::max(cos_emission, grazing_cos));
}

double LampEmission::aperture_power(double power_w, const Eigen::Vector3d& direction,
                                    double cos_emission, double cos_incidence, double distance_m,
                                    double area_m2) const {
  if (!profile_)
    return occ::aperture_power(power_w, order_, cos_emission, cos_incidence, distance_m, area_m2);
  if (cos_incidence <= 0) return 0;
  return intensity(power_w, direction, cos_emission) * area_m2 * cos_incidence /
         (distance_m * distance_m);
}

Eigen::Vector3d LampEmission::log_gradient(const Eigen::Vector3d& direction) const {
  const double cos_emission = direction.dot(normal_);
  if (!(cos_emission > 0)) return Eigen::Vector3d::Zero();
  if (!profile_) return order_ / cos_emission * (normal_ - cos_emission * direction);
  Eigen::Vector3d gradient;
  const double f = profile_->density(to_lamp_ * direction, &gradient);
  if (!(f > 0)) return Eigen::Vector3d::Zero();
  return to_lamp_.transpose() * gradient / f;
}

}  // namespace occ::internal::scene
