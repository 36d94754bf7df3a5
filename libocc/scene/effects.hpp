// SPDX-License-Identifier: Apache-2.0
// Which effects a rendered image of the scene contains. An effect is called for by what the scene
// says (a PSF width, a reflectance, boxes, a waveform); its use says whether to render it then:
// always, never, or when leaving it out would change the image by more than a tolerance.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "libocc/core/abi.hpp"

namespace occ {

enum class Effect {
  extent,           ///< lamps have a shape; else they are points of the same power
  light_gradient,   ///< the lamp's irradiance varies over its image (cos^4, Lambert's law)
  psf,              ///< blur by the lens: Gaussian, diffraction, defocus
  distortion,       ///< of the lens
  vignetting,       ///< of the lens, beyond cos^4
  motion_blur,      ///< the camera moves during the exposure
  rolling_shutter,  ///< the camera moves between rows
  modulation,       ///< lamps blink
  occlusion,        ///< boxes hide lamps
  ambient,          ///< light that comes from no lamp
  walls,            ///< the room's surfaces reflect the lamps' light, once
  interreflection,  ///< and reflect each other's
  glare,            ///< part of the light spreads over the image
  ghosts,           ///< second images inside the lens
  mosaic,           ///< colour filters over the pixels
  gain,             ///< pixels differ in their gain
  noise,            ///< shot noise, dark current's noise, read noise
  saturation,       ///< a full well holds no more
  blooming,         ///< and its charge spills into its neighbours
  response,         ///< grey levels are no linear function of the light
};
constexpr std::size_t effect_count = 20;

/// As scene files write it: "light_gradient".
LIBOCC_API const char* effect_name(Effect effect);

/// Throws std::invalid_argument with the nearest known name.
LIBOCC_API Effect effect_named(const std::string& name);

enum class Use {
  on,         ///< rendered when called for
  off,        ///< never rendered
  automatic,  ///< rendered when called for and a bound on what it does exceeds its tolerance
};

struct LIBOCC_API Effects {
  std::array<Use, effect_count> use{};  ///< by Effect
  double tolerance_dn = 0.5;            ///< grey levels that leaving an effect out may change
  double tolerance_px = 0.02;           ///< and how far a lamp's centroid may move

  Use of(Effect effect) const { return use[static_cast<std::size_t>(effect)]; }
  void set(Effect effect, Use value) { use[static_cast<std::size_t>(effect)] = value; }

  /// Throws std::invalid_argument naming the field and its value.
  void validate() const;
};

}  // namespace occ
