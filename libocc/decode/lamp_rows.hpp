// SPDX-License-Identifier: Apache-2.0
// The light of one lamp as a signal over time. A rolling shutter exposes the lines of a lamp's
// image one after the other, so that each line is a sample of its light; a global shutter gives one
// sample a frame. Sampled is the lamp's place, whether it is lit or not.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/codes/decode_samples.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ {

/// The pixels about a centre that may be lit by a lamp.
struct LampWindow {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double half_width_px = 0, half_height_px = 0;
};

/// Light of one line above the background, from the pixels of one colour.
struct LineLight {
  int line = 0;  ///< from the window's centre
  double start_s = 0;
  double value_dn = 0;  ///< linear signal, summed along the line
  double sigma_dn = 0;
  int channel = 0;  ///< colour of a mosaic's pixels: 0 red, 1 green, 2 blue
};

/// Lines of the part of the window that is in the image; empty when none is. `start_s`: when the
/// first line of the image begins its exposure. Throws std::invalid_argument for a bad view.
LIBOCC_API std::vector<LineLight> lamp_lines(const ImageView& image, const Sensor& sensor,
                                             double start_s, const LampWindow& window);

/// Samples from the lines of all frames of one lamp, each over the light that the line has when it
/// is lit, which is that of its brightest frames. Lines that the lamp hardly lights are left out.
LIBOCC_API std::vector<LightSample> light_samples(
    const std::vector<std::vector<LineLight>>& lines_by_frame, const Sensor& sensor);

}  // namespace occ
