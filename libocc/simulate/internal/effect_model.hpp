// SPDX-License-Identifier: Apache-2.0
// One effect as the plan sees it: when a scene calls for it, and what leaving it out changes at
// most. Every effect has a file in simulate/effects/ that defines its model, and the code that
// applies it if it is not part of a lamp's image.
#pragma once

#include <array>
#include <limits>

#include "libocc/simulate/internal/view.hpp"

namespace occ::internal::simulate {

/// Of the noise-free image: grey levels at any pixel, pixels of any lamp's centroid.
struct Bound {
  double dn = 0, px = 0;

  void include(const Bound& other) {
    if (!(other.dn <= dn)) dn = other.dn;
    if (!(other.px <= px)) px = other.px;
  }
};

struct EffectModel {
  /// What of the scene calls for it, for messages: "sensor.psf_sigma_px".
  const char* called_for_by;
  bool (*called_for)(const Scene& scene, const SimulateOptions& options);
  Bound (*bound)(const SceneView& view);
};

extern const EffectModel extent_model, light_gradient_model, psf_model, distortion_model,
    vignetting_model, motion_blur_model, rolling_shutter_model, modulation_model, occlusion_model,
    ambient_model, walls_model, interreflection_model, glare_model, ghosts_model, mosaic_model,
    gain_model, noise_model, saturation_model, blooming_model, response_model;

}  // namespace occ::internal::simulate
