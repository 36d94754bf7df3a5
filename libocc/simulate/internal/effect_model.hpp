// SPDX-License-Identifier: Apache-2.0
// Describes one effect of the simulation: when a scene has it, how it changes the image, and a
// bound on the change when it is left out.
//
// Each effect has one file in simulate/effects/, which defines its EffectModel; the functions of
// the model are in a namespace of its own, because the files are compiled together. A new effect
// needs: an enumerator and effect_count (scene/effects.hpp) and a name (scene/effects.cpp); that
// file; its model in the declaration below and in effect_models(), and in render_order if it has
// `render`; if the estimators model it, a line in Scene::as_rendered(); if it adds light, a term in
// background_electrons() (simulate/bounds.cpp). tests/simulate/effect_models_test.cpp checks the
// lists. Its parameters are fields of the scene (scene/internal/scene_fields.hpp).
#pragma once

#include <array>
#include <optional>

#include "libocc/simulate/internal/scene_view.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

struct Frame;

/// Largest change of the noise-free image.
struct Bound {
  double dn = 0;  ///< change of any pixel [grey levels]
  double px = 0;  ///< displacement of the centroid of any lamp's image [px]

  /// Takes the larger value of each; NaN counts as larger than any number.
  void include(const Bound& other) {
    if (!(other.dn <= dn)) dn = other.dn;
    if (!(other.px <= px)) px = other.px;
  }
};

/// Part of the rendering in which an effect acts.
enum class Stage {
  lamp_image,  ///< image of each lamp; ghosts are further lamp images, so they change as well
  charge,      ///< charge of a pixel before it overflows, by other light or by the sensor
  output,      ///< charge that overflows, noise and grey levels
};

struct EffectModel {
  Effect effect;
  Stage stage;
  /// True if the scene and the options have this effect.
  bool (*called_for)(const Scene& scene, const SimulateOptions& options);
  const char* absence;  ///< reason to report when it is not called for: "sensor.blooming is 0"
  /// Bound on the change when the effect is left out.
  Bound (*bound)(const SceneView& view);
  /// Effect without which this one cannot occur.
  std::optional<Effect> required = {};
  /// Upper limit of the electrons that the effect adds to a pixel outside the lamps' images.
  double (*background_e)(const SceneView& view) = nullptr;
  /// Renders the effect after the lamps' images. `lamp_electrons` is the sum of the lamps'
  /// electrons over the image, as if all pixels had the same colour filter, for each of the four
  /// filters.
  void (*render)(const Frame& frame, const ByPlace& lamp_electrons, Signal& signal) = nullptr;
  /// Removes the effect from the sensor that converts electrons to grey levels.
  void (*remove)(Sensor& sensor) = nullptr;
};

extern const EffectModel ambient_model, blooming_model, distortion_model, extent_model, gain_model,
    ghosts_model, glare_model, interreflection_model, light_gradient_model, modulation_model,
    mosaic_model, motion_blur_model, noise_model, occlusion_model, psf_model, response_model,
    rolling_shutter_model, saturation_model, vignetting_model, walls_model;

/// All models; their order has no meaning.
LIBOCC_API const std::array<const EffectModel*, effect_count>& effect_models();

/// The model of one effect.
LIBOCC_API const EffectModel& effect_model(Effect effect);

/// Order of the effects that have `render`. Gain acts on all photoelectrons, and the charge that
/// overflows includes them all.
constexpr std::array<Effect, 6> render_order{Effect::ghosts, Effect::walls, Effect::ambient,
                                             Effect::glare,  Effect::gain,  Effect::blooming};

}  // namespace occ::internal::simulate
