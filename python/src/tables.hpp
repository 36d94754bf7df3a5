// SPDX-License-Identifier: Apache-2.0
// Keyword options that several functions share.
#pragma once

#include "fields.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/identify/identify.hpp"
#include "libocc/refine/refine.hpp"

namespace occ::python {

inline auto detect_fields() {
  using O = DetectOptions;
  return std::make_tuple(
      field("sensor", &O::sensor, "Sensor for noise, full scale, stripes; None: estimate"),
      field("threshold_sigma", &O::threshold_sigma, "threshold above the background [its sigma]"),
      field("threshold_dn", &O::threshold_dn, "absolute threshold [grey levels] instead"),
      field("min_area_px", &O::min_area_px, "smaller blobs are dropped [px]"),
      field("max_blobs", &O::max_blobs, "the brightest are kept"),
      field("rims", &O::rims, "measure sub-pixel rims of discs"),
      field("stripes", &O::stripes, "join stripes, read frequencies; None: when rows have a time"),
      field("max_frequency_hz", &O::max_frequency_hz, "stripes are read up to this [Hz]"));
}

inline auto identify_fields() {
  using O = IdentifyOptions;
  return std::make_tuple(
      field("method", &O::method, "search method"),
      field("seed", &O::seed, "seed of random assignments"),
      field("index", &O::index, "LampIndex of the scene, for hashing"),
      field("use_frequency", &O::use_frequency, "use blink frequencies"),
      field("frequency_gate_sigma", &O::frequency_gate_sigma,
            "gate between a blob's frequency and a lamp's [sigma]"),
      field("frequency_tolerance", &O::frequency_tolerance,
            "relative error of lamp and row clocks"),
      field("gate_sigma", &O::gate_sigma, "gate between a projected lamp and a blob [sigma]"),
      field("gate_model_sigma_px", &O::model_sigma_px, "camera and map error in every gate [px]"),
      field("miss_penalty", &O::miss_penalty,
            "chi-square of a lamp that should be visible but matches no blob"),
      field("use_brightness", &O::use_brightness,
            "rank poses and reject reflections by brightness and size"),
      field("light_sigma", &O::light_sigma,
            "relative error of a predicted flux besides the lamp's power_sigma"),
      field("max_hypotheses", &O::max_hypotheses, "maximum number of assignments tried"));
}

inline auto refine_fields() {
  using O = RefineOptions;
  return std::make_tuple(
      field("rung", &O::rung, "what of the image the pose has to explain"),
      field("flux", &O::flux, "whether lamps' brightness counts, and what is known of it"),
      field("model_sigma_px", &O::model_sigma_px, "camera and map error per lamp [px]"),
      field("huber_sigma", &O::huber_sigma, "residuals beyond this weigh linearly [sigma]"),
      field("max_iterations", &O::max_iterations, "steps of the refinement"),
      field("tolerance_px", &O::tolerance_px, "converged when no lamp moves further [px]"));
}

}  // namespace occ::python
