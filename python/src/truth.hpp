// SPDX-License-Identifier: Apache-2.0
// Options and ground truth, shared by simulate(), plan_render() and Renderer.
#pragma once

#include <memory>
#include <tuple>
#include <vector>

#include "fields.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ::python {

/// Ground truth of an image, and the input that it was rendered from.
struct Truth {
  std::shared_ptr<const Scene> scene;
  SimulateOptions options;
  Rigid3 cam_from_world;
  std::vector<LampTruth> lamps;
};

inline auto options_fields() {
  using O = SimulateOptions;
  return std::make_tuple(
      field("seed", &O::seed, "seed of the noise; the same seed gives the same image"),
      field("frame", &O::frame, "index of the image; images of one seed differ in noise"),
      field("noise", &O::noise, "shot and read noise"),
      field("noise_area", &O::noise_area, "pixels that have noise; around_lamps is much faster"),
      field("start_s", &O::start_s, "time at which the first row's exposure begins [s]"),
      field("spacing_sigma", &O::spacing_sigma, "distance of the samples along a rim [PSF sigmas]"),
      field("velocity", &O::velocity,
            "(6,) velocity of the camera: d [rotation, translation] / dt of cam_from_world's left "
            "perturbation [rad/s, m/s]"));
}

}  // namespace occ::python
