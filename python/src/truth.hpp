// SPDX-License-Identifier: Apache-2.0
// What simulate(), plan_render() and Renderer share: their options, and what is true of an image.
#pragma once

#include <memory>
#include <tuple>
#include <vector>

#include "fields.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ::python {

/// The part of Rendered that is not the image, and what it was rendered from.
struct Truth {
  std::shared_ptr<const Scene> scene;
  SimulateOptions options;
  Rigid3 cam_from_world;
  std::vector<LampTruth> lamps;
};

inline auto options_fields() {
  using O = SimulateOptions;
  return std::make_tuple(
      field("seed", &O::seed, "of the noise; the same seed gives the same image"),
      field("frame", &O::frame, "noise differs from frame to frame under one seed"),
      field("noise", &O::noise, "shot and read noise"),
      field("noise_area", &O::noise_area, "around lamps alone it is much faster"),
      field("start_s", &O::start_s, "time at which the first row's exposure begins [s]"),
      field("spacing_sigma", &O::spacing_sigma, "rim samples are this many PSF sigmas apart"),
      field("velocity", &O::velocity,
            "(6,) of the camera: d [rotation, translation] / dt of cam_from_world's left "
            "perturbation [rad/s, m/s]"));
}

}  // namespace occ::python
