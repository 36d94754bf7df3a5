// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/emission.hpp"

#include <cmath>
#include <limits>

namespace occ::internal::refine {

EmissionSlope::EmissionSlope(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                             const Eigen::Vector2d& centre_px, const Eigen::Vector2d& reach_px)
    : centre_px_(centre_px) {
  const Eigen::Vector3d normal = cam_from_world.rotation * lamp.normal;
  const auto log_cos = [&](double u, double v) {
    const auto bearing = camera.unproject(centre_px + reach_px.cwiseProduct(Eigen::Vector2d(u, v)));
    return bearing ? std::log(-bearing->dot(normal)) : std::numeric_limits<double>::quiet_NaN();
  };
  const double middle = log_cos(0, 0), left = log_cos(-1, 0), right = log_cos(1, 0);
  const double up = log_cos(0, -1), down = log_cos(0, 1);
  const double cross = log_cos(1, 1) + log_cos(-1, -1) - log_cos(1, -1) - log_cos(-1, 1);
  if (!std::isfinite(middle + left + right + up + down + cross)) return;
  const double x = reach_px.x(), y = reach_px.y();
  gradient_ = {(right - left) / (2 * x), (down - up) / (2 * y)};
  xx_ = (left + right - 2 * middle) / (2 * x * x);
  yy_ = (up + down - 2 * middle) / (2 * y * y);
  xy_ = cross / (4 * x * y);
}

void change_order(const Lamp& lamp, double order, const Rigid3& reference, Lamp& changed) {
  const double before = lamp.order();
  const Eigen::Vector3d ray = (reference * lamp.centre_m).normalized();
  const double cos_emission = -ray.dot(reference.rotation * lamp.normal);
  if (!(cos_emission > 0)) return;
  changed.power_w =
      lamp.power_w * (before + 1) / (order + 1) * std::pow(cos_emission, before - order);
  changed.half_power_rad = std::acos(std::exp2(-1 / order));
}

}  // namespace occ::internal::refine
