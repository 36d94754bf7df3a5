// SPDX-License-Identifier: Apache-2.0
// Blur by the lens. Left out, a pixel is the mean over its box alone. Moving a lamp's image by s
// changes a pixel by no more than |s| times the length of rim inside it, and a convex rim has at
// most the pixel's own circumference there, two of whose four sides face any one direction; the
// blur moves to both sides evenly, of which a kink takes one: at most
//     2 E|s|/2 = 2 sigma/sqrt(2 pi)
// of a fully covered pixel. Centroids do not move.
#include <cmath>

#include "libocc/simulate/internal/effect_model.hpp"

namespace occ {
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  return scene.sensor.psf_sigma_px > 0;
}

Bound bound(const View& view) {
  constexpr double root_of_two_pi = 2.5066282746310002;
  Bound bound;
  const double share = std::min(1.0, 2 * view.scene.sensor.psf_sigma_px / root_of_two_pi);
  for (const LampView& seen : view.lamps) {
    const double sharp = seen.rim_px.empty() ? seen.electrons : seen.full_e;
    bound.include({view.grey_levels(share * sharp), 0});
  }
  return bound;
}

}  // namespace

const EffectModel psf_model{"sensor.psf_sigma_px", called_for, bound};

}  // namespace occ
