// SPDX-License-Identifier: Apache-2.0
// Transmission of a lens at a pixel (vignetting), beyond cos^4.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::scene {

class Vignetting {
 public:
  explicit Vignetting(const Scene& scene);

  /// 1 + a1 q^2 + a2 q^4 + ... (Lens::vignetting); beyond the farthest corner the value at the
  /// corner.
  double transmission(const Eigen::Vector2d& px) const;

 private:
  const std::vector<double>& coefficients_;
  Eigen::Vector2d principal_px_;
  double corner_px2_ = 0;  // squared distance of the farthest corner
};

}  // namespace occ::internal::scene
