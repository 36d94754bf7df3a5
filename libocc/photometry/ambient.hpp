// SPDX-License-Identifier: Apache-2.0
// Ambient irradiance of the sensor from images whose lamps are where the scene and the poses say.
// Of the pixels that no lamp reaches, the mean of the linear signal is
//
//     S = K (e(E) - e(0)) + K e(0),      e: Sensor::electrons, K: gain
//
// and its sigma has three parts: the pixels' own noise, which every image has afresh; what rounding
// to grey levels leaves open where noise is too small to blur it, at most
// exp(-2 pi^2 sigma^2) / sqrt(12) of a level (Widrow, Kollar, "Quantization Noise", 2008: moments
// of a quantised Gaussian); and the pixels' gains, the same in all images.
// Lamps' fluxes are over the local background, so this and calibrate_light do not depend on each
// other. Black level and dark current are the scene's: an error of theirs is one of E.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// What one image says of the ambient light.
struct AmbientImage {
  std::string left_out;  ///< why it does not count; empty when it does
  int pixels = 0;        ///< that no lamp reaches
  double irradiance_w_m2 = 0;
  double sigma_w_m2 = 0;  ///< of its pixels' noise
};

struct AmbientLight {
  double irradiance_w_m2 = 0;  ///< negative when there is less than the dark image's noise
  double variance_w2_m4 = std::numeric_limits<double>::infinity();  ///< contains variance_factor
  double chi2 = 0;                                                  ///< of the images' irradiances
  int dof = 0;
  double variance_factor = 1;  ///< 1 unless chi2 is too large to be chance
  std::vector<AmbientImage> images;
};

/// Status: ok; degenerate when no image has a background that tells it: grey levels cut off at 0 or
/// at full scale, too few pixels, or light of lamps everywhere (walls, glare, ghosts), or when the
/// background is darker than the scene's black level. Throws std::invalid_argument when images and
/// poses are not as many, an image is not of the camera's size, the scene does not validate, has a
/// colour mosaic or switches ambient light off.
LIBOCC_API Result<AmbientLight> calibrate_ambient(const Scene& scene,
                                                  const std::vector<ImageView>& images,
                                                  const std::vector<Rigid3>& cam_from_world);

}  // namespace occ
