// SPDX-License-Identifier: Apache-2.0
// PSF: blur by the lens (formation/internal/lens_blur.hpp). Without the effect, a pixel is the
// exact mean over its box. The blur moves light by s, which sweeps at most |s_x| + |s_y| of a fully
// covered pixel's area. The pixel changes by at most
//     2 E|s_x|,   E|s_x| <= sigma sqrt(2/pi) + 4 rho / (3 pi),
// with E| | the expectation, for the Gaussian of width sigma and the defocus disc of radius rho.
// All light of a point may move to another pixel. The centroid of the light does not move, but the
// centroid of sharp pixels differs from it (internal/scene_view.hpp).
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/simulate/internal/bounds.hpp"

namespace occ::internal::simulate {

using namespace internal::formation;
namespace psf_effect {
namespace {

// Sensor::validate requires a positive psf_sigma_px.
bool called_for(const Scene&, const SimulateOptions&) { return true; }

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
}  // namespace psf_effect

const EffectModel psf_model{Effect::psf, Stage::lamp_image, psf_effect::called_for,
                            "never, since sensor.psf_sigma_px is positive", psf_effect::bound};

}  // namespace occ::internal::simulate
