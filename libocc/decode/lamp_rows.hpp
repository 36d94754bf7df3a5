// SPDX-License-Identifier: Apache-2.0
// The light of one lamp as a signal over time. A rolling shutter exposes the lines of a lamp's
// image one after the other, so each line is a sample of its light; a global shutter gives one
// sample per frame. The window of the lamp is sampled whether the lamp is lit or not.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/codes/decode_samples.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ {

/// Pixels around a centre that a lamp may illuminate.
struct LampWindow {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();  ///< middle of the window
  double half_width_px = 0, half_height_px = 0;         ///< half sides along x and y
};

/// Light of one line above the background, from the pixels of one colour.
struct LineLight {
  int line = 0;         ///< line index relative to the window's centre
  double start_s = 0;   ///< begin of the line's exposure
  double value_dn = 0;  ///< linear signal, summed along the line
  double sigma_dn = 0;  ///< standard deviation of value_dn, from the sensor's noise
  int channel = 0;      ///< colour of the pixels: 0 red, 1 green, 2 blue; 0 without a mosaic
};

/// Returns the lines of the part of the window inside the image; may be empty. `start_s`: start of
/// the exposure of the image's first line. Throws std::invalid_argument for an invalid view.
LIBOCC_API std::vector<LineLight> lamp_lines(const ImageView& image, const Sensor& sensor,
                                             double start_s, const LampWindow& window);

/// Converts the lines of all frames of one lamp to samples. Each is divided by the light of the
/// same line when the lamp is lit (mean of its brightest quarter of frames). Lines with little
/// light from the lamp are omitted.
LIBOCC_API std::vector<LightSample> light_samples(
    const std::vector<std::vector<LineLight>>& lines_by_frame, const Sensor& sensor);

}  // namespace occ
