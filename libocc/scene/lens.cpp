// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/lens.hpp"

#include <cmath>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

void validate_vignetting(const std::vector<double>& coefficients) {
  constexpr int samples = 100;  // dense for a polynomial of a few coefficients
  for (int i = 1; i <= samples; ++i) {
    const double q2 = std::pow(static_cast<double>(i) / samples, 2);
    double transmission = 1, power = 1;
    for (const double a : coefficients) transmission += a * (power *= q2);
    require(transmission > 0 && transmission <= 1, "lens.vignetting", transmission,
            "a transmission in (0, 1] over the whole image");
  }
}

}  // namespace

void Lens::validate() const {
  check_fields(*this, lens_fields, "lens.");
  validate_vignetting(vignetting);
  for (std::size_t i = 0; i < ghosts.size(); ++i) {
    const auto owner = [&] { return "lens.ghosts[" + std::to_string(i) + "]."; };
    check_fields(ghosts[i], ghost_fields, owner);
    const double scale = ghosts[i].scale;
    if (!(std::isfinite(scale) && scale != 0))
      require(false, owner() + "scale", scale, "finite, not zero");
  }
}

}  // namespace occ
