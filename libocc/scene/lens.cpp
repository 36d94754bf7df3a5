// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/lens.hpp"

#include <cmath>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

void validate_vignetting(const std::vector<double>& coefficients) {
  constexpr int samples = 100;  // of a smooth curve
  for (int i = 1; i <= samples; ++i) {
    const double q2 = std::pow(static_cast<double>(i) / samples, 2);
    double transmission = 1, power = 1;
    for (const double a : coefficients) transmission += a * (power *= q2);
    require(transmission > 0 && transmission <= 1, "lens.vignetting", transmission,
            "a transmission in (0, 1] all over the image");
  }
}

}  // namespace

void Lens::validate() const {
  if (focus_distance_m)
    require(*focus_distance_m > 0 && std::isfinite(*focus_distance_m), "lens.focus_distance_m",
            *focus_distance_m, "positive");
  validate_vignetting(vignetting);
  require(veiling_glare >= 0 && veiling_glare < 1, "lens.veiling_glare", veiling_glare,
          "in [0, 1)");
  for (std::size_t i = 0; i < ghosts.size(); ++i) {
    const Ghost& ghost = ghosts[i];
    const auto name = [&](const char* field) {
      return "lens.ghosts[" + std::to_string(i) + "]." + field;
    };
    require(ghost.strength >= 0 && ghost.strength < 1, name("strength"), ghost.strength,
            "in [0, 1)");
    require(std::isfinite(ghost.scale) && ghost.scale != 0, name("scale"), ghost.scale,
            "finite, not zero");
    require(ghost.blur_px >= 0 && ghost.blur_px <= 50, name("blur_px"), ghost.blur_px,
            "in [0, 50]");
  }
}

}  // namespace occ
