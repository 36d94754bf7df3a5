// SPDX-License-Identifier: Apache-2.0
// Selection of the effects that a rendered image contains.
//
// The scene's content requires an effect (a PSF width, a reflectance, boxes, a waveform). The
// effect's Use then decides: always rendered, never rendered, or rendered if leaving it out would
// change the image by more than a tolerance.
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "libocc/core/abi.hpp"

namespace occ {

/// Effects of light, lens, motion and sensor on an image.
enum class Effect {
  extent,           ///< lamps have a shape; without it they are points of the same power
  light_gradient,   ///< the lamp's irradiance varies over its image (cos^4, Lambert's law)
  psf,              ///< blur by the lens: Gaussian, diffraction, defocus
  distortion,       ///< distortion of the lens
  vignetting,       ///< loss of light in the lens beyond cos^4
  motion_blur,      ///< the camera moves during the exposure
  rolling_shutter,  ///< the camera moves between rows
  modulation,       ///< lamps blink
  occlusion,        ///< boxes hide lamps
  ambient,          ///< light from other sources than the lamps
  walls,            ///< the room's surfaces reflect the lamps' light, once
  interreflection,  ///< light is reflected between the room's surfaces
  glare,            ///< part of the light spreads over the image
  ghosts,           ///< second images inside the lens
  mosaic,           ///< colour filters over the pixels
  gain,             ///< pixels differ in their gain
  noise,            ///< shot noise, dark current's noise, read noise
  saturation,       ///< the charge of a pixel is limited to the full well
  blooming,         ///< charge beyond the full well spills into neighbouring pixels
  response,         ///< grey levels are a nonlinear function of the light
};
constexpr std::size_t effect_count = 20;  ///< number of enumerators of Effect

/// Name of an effect in scene files, such as "light_gradient".
LIBOCC_API const char* effect_name(Effect effect);

/// The effect of that name. Throws std::invalid_argument that suggests the nearest known name.
LIBOCC_API Effect effect_named(const std::string& name);

/// Selection of one effect.
enum class Use {
  on,         ///< rendered if the scene requires it
  off,        ///< never rendered
  automatic,  ///< rendered if the scene requires it and the bound on its change exceeds a tolerance
};

/// Selection of all effects, with the tolerances of automatic choice.
struct LIBOCC_API Effects {
  std::array<Use, effect_count> use{};  ///< indexed by Effect
  double tolerance_dn = 0.5;   ///< allowed change of a grey level by an effect that is left out
  double tolerance_px = 0.02;  ///< allowed shift of a lamp's centroid by such an effect

  /// Selection of one effect.
  Use of(Effect effect) const { return use[static_cast<std::size_t>(effect)]; }
  /// Changes the selection of one effect.
  void set(Effect effect, Use value) { use[static_cast<std::size_t>(effect)] = value; }

  /// Throws std::invalid_argument naming the field and its value.
  void validate() const;
};

}  // namespace occ
