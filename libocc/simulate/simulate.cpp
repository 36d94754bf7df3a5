// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/simulate.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/core/require.hpp"
#include "libocc/simulate/renderer.hpp"

namespace occ {

void SimulateOptions::validate() const {
  require(std::isfinite(start_s), "start_s", start_s, "finite");
  require(spacing_sigma > 0 && spacing_sigma <= 2, "spacing_sigma", spacing_sigma, "in (0, 2]");
  require(velocity.allFinite(), "velocity", velocity.transpose(), "finite");
}

Rendered simulate(const Scene& scene, const Rigid3& cam_from_world,
                  const SimulateOptions& options) {
  Rendered rendered;
  Renderer(scene).render(cam_from_world, options, rendered);
  return rendered;
}

}  // namespace occ
