// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/prior.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/scene/internal/vector_text.hpp"

namespace occ {
namespace {

double square(double value) { return value * value; }

// Angle between two directions, accurate near 0 and pi alike.
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

void require_positive(double value, const char* name) {
  require(value > 0 && std::isfinite(value), name, value, "positive");
}

}  // namespace

double Prior::chi2(const Rigid3& cam_from_world) const {
  double sum = 0;
  if (position_m)
    sum +=
        (cam_from_world.origin_in_source() - *position_m).squaredNorm() / square(position_sigma_m);
  if (heading_rad) {
    const double turn = occ::heading_rad(cam_from_world) - *heading_rad;
    sum += square(std::atan2(std::sin(turn), std::cos(turn)) / heading_sigma_rad);
  }
  if (gravity_in_cam) {
    const Eigen::Vector3d down = -cam_from_world.rotation.col(2);
    sum += square(angle_between(down, *gravity_in_cam) / gravity_sigma_rad);
  }
  return sum;
}

void Prior::validate() const {
  if (position_m)
    require(position_m->allFinite(), "prior.position_m", vector_text(*position_m), "finite");
  require_positive(position_sigma_m, "prior.position_sigma_m");
  if (heading_rad)
    require(std::isfinite(*heading_rad), "prior.heading_rad", *heading_rad, "finite");
  require_positive(heading_sigma_rad, "prior.heading_sigma_rad");
  if (gravity_in_cam)
    require(std::abs(gravity_in_cam->norm() - 1) < 1e-3, "prior.gravity_in_cam",
            vector_text(*gravity_in_cam), "a unit vector");
  require_positive(gravity_sigma_rad, "prior.gravity_sigma_rad");
}

}  // namespace occ
