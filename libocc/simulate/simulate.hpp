// SPDX-License-Identifier: Apache-2.0
// Renders what a camera sees of the lamps, with the truth. Effects so far: extended lamps by their
// rim integral, PSF, Lambertian and cos^4 gradient over the lamp, blinking under a rolling shutter,
// saturation, response, shot and read noise, quantisation. The same seed gives the same bits.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

struct SimulateOptions {
  std::uint64_t seed = 0;
  std::uint32_t frame = 0;  ///< noise differs from frame to frame under one seed
  bool noise = true;        ///< shot and read noise
  double start_s = 0;       ///< time at which the first row's exposure begins
  double spacing_sigma =
      1.0;  ///< rim samples are this many PSF sigmas apart: accuracy against time
};

/// What is true of one lamp in the rendered image.
struct LampTruth {
  int id = 0;
  bool in_view = false;                                 ///< some of its image lies on the sensor
  bool whole = false;                                   ///< all of its rim does
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< projection of the lamp's centre
  Eigen::Vector2d image_centre_px =
      Eigen::Vector2d::Zero();          ///< centre of the lamp's image (ellipse centre)
  double electrons = 0;                 ///< signal electrons of its image on the sensor
  std::vector<Eigen::Vector2d> rim_px;  ///< empty when it is not in view
};

struct Rendered {
  Image image;
  Rigid3 cam_from_world;
  std::vector<LampTruth> lamps;  ///< one for each lamp of the scene, in its order
};

/// Throws std::invalid_argument when the scene does not validate or the pose is not finite.
LIBOCC_API Rendered simulate(const Scene& scene, const Rigid3& cam_from_world,
                             const SimulateOptions& options = {});

}  // namespace occ
