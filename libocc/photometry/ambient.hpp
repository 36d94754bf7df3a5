// SPDX-License-Identifier: Apache-2.0
// Ambient irradiance E on the sensor from images with known lamps and poses. The pixels without
// light of lamps have the mean linear signal
//
//     S = K (e(E) - e(0)) + K e(0),      e: Sensor::electrons, K: gain
//
// Its variance has three parts: the pixels' noise, independent in each image; the rounding to grey
// levels, at most exp(-2 pi^2 sigma^2) / sqrt(12) of a level for noise sigma (Widrow, Kollar,
// "Quantization Noise", 2008: moments of a quantised Gaussian); and the pixels' gains, the same in
// all images.
//
// The lamps' fluxes are measured above the local background, so calibrate_ambient() and
// calibrate_light() are independent. Black level and dark current are taken from the scene; their
// errors enter E.
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

/// Ambient light estimated from one image.
struct AmbientImage {
  std::string left_out;        ///< reason for exclusion; empty: the image is used
  int pixels = 0;              ///< number of pixels without light of lamps
  double irradiance_w_m2 = 0;  ///< estimate from this image alone
  double sigma_w_m2 = 0;       ///< standard deviation from the noise of its pixels
};

/// Ambient light estimated from all images.
struct AmbientLight {
  double irradiance_w_m2 = 0;  ///< may be negative within the noise
  double variance_w2_m4 = std::numeric_limits<double>::infinity();  ///< contains variance_factor
  double chi2 = 0;                   ///< scatter of the images' irradiances
  int dof = 0;                       ///< number of used images less one
  double variance_factor = 1;        ///< 1 unless chi2 exceeds its 99.9 % quantile
  std::vector<AmbientImage> images;  ///< in the given order
};

/// cam_from_world: pose of each image. Status: ok; degenerate: no image has a usable background
/// (grey levels clipped at 0 or at full scale, too few pixels), the scene adds light of lamps to it
/// (walls, glare, ghosts), or it is darker than the scene's black level. Throws
/// std::invalid_argument for another number of poses than of images, an image of another size than
/// the camera's, an invalid scene, a colour mosaic, or a scene with ambient light switched off.
LIBOCC_API Result<AmbientLight> calibrate_ambient(const Scene& scene,
                                                  const std::vector<ImageView>& images,
                                                  const std::vector<Rigid3>& cam_from_world);

}  // namespace occ
