// SPDX-License-Identifier: Apache-2.0
// What part of the light a lens lets through to a pixel, beyond cos^4.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::scene {

class Vignetting {
 public:
  explicit Vignetting(const Scene& scene);

  /// 1 + a1 q^2 + a2 q^4 + ..., see Lens::vignetting; beyond the farthest corner as there.
  double transmission(const Eigen::Vector2d& px) const;

 private:
  const std::vector<double>& coefficients_;
  Eigen::Vector2d principal_px_;
  double corner_px2_ = 0;  // squared distance of the farthest corner
};

}  // namespace occ::internal::scene
