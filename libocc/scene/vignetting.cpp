// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/vignetting.hpp"

#include <algorithm>

namespace occ::internal::scene {

Vignetting::Vignetting(const Scene& scene)
    : coefficients_(scene.lens.vignetting),
      principal_px_(scene.camera.cx_px(), scene.camera.cy_px()) {
  for (const double x : {-0.5, scene.camera.width() - 0.5})
    for (const double y : {-0.5, scene.camera.height() - 0.5})
      corner_px2_ = std::max(corner_px2_, (Eigen::Vector2d(x, y) - principal_px_).squaredNorm());
}

double Vignetting::transmission(const Eigen::Vector2d& px) const {
  const double q2 = std::min(1.0, (px - principal_px_).squaredNorm() / corner_px2_);
  double transmission = 0;
  for (std::size_t i = coefficients_.size(); i-- > 0;)
    transmission = (transmission + coefficients_[i]) * q2;
  return 1 + transmission;
}

}  // namespace occ::internal::scene
