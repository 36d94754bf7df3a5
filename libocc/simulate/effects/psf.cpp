// SPDX-License-Identifier: Apache-2.0
// Blur by the lens (formation/internal/lens_blur.hpp). Left out, a pixel is the exact mean over its
// box. The blur moves light by s; of a fully covered pixel no more than |s_x| + |s_y| of its area
// is swept then, at a lamp of just its size, so that it changes by at most
//     2 E|s_x|,   E|s_x| <= sigma sqrt(2/pi) + 4 rho / (3 pi)
// for the Gaussian and the disc of radius rho. A point's light may be all in another pixel. The
// light's centroid does not move, but that of sharp pixels is not the light's (internal/blur.hpp).
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/simulate/internal/blur.hpp"
#include "libocc/simulate/internal/effect_model.hpp"
#include "libocc/simulate/internal/overlap.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace {

bool called_for(const Scene& scene, const SimulateOptions&) {
  return scene.sensor.psf_sigma_px > 0 || scene.lens.diffraction || scene.lens.focus_distance_m;
}

Bound bound_of(const LampView& seen, const SceneView& view) {
  const double sigma = gaussian_blur_px(view.scene);
  const bool point = is_point(seen, view);
  const double sampling = sampling_shift_px(seen, 0, point) + sampling_shift_px(seen, sigma, point);
  if (point) return {seen.electrons, sampling};
  const double depth_m = view.scene.camera.depth_m(view.cam_from_world * seen.lamp->centre_m);
  const double moved =
      std::sqrt(2 / pi) * sigma + 4 / (3 * pi) * defocus_radius_px(view.scene, depth_m);
  return {std::min(1.0, 2 * moved) * seen.full_e, sampling};
}

Bound bound(const SceneView& view) { return sum_of_overlapping(view, bound_of); }

}  // namespace

const EffectModel psf_model{"sensor.psf_sigma_px or the lens", called_for, bound};

}  // namespace occ::internal::simulate
