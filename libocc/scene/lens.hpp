// SPDX-License-Identifier: Apache-2.0
// What a lens does to the light beside projecting it. Nothing unless said. Data only.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// A faint second image of everything, by two reflections inside the lens: a point at p appears at
/// c + scale (p - c) too, c the principal point.
struct Ghost {
  double strength = 0;  ///< part of the light that goes there
  double scale = -1;    ///< negative: turned about the principal point, as most are
  double blur_px = 0;   ///< standard deviation of its own blur, beside the lens's
};

struct LIBOCC_API Lens {
  /// Adds a Gaussian blur of 0.42 wavelength x f-number to the PSF (core of the Airy disc).
  bool diffraction = false;
  /// Lamps nearer or farther are blurred by a disc; none: everything is in focus.
  std::optional<double> focus_distance_m;
  /// Transmission 1 + a1 q^2 + a2 q^4 + ..., q the distance from the principal point over that of
  /// the image's farthest corner; cos^4 is there without it. In (0, 1] over the image.
  std::vector<double> vignetting;
  double veiling_glare = 0;  ///< part of the lamps' light that spreads evenly over the image
  std::vector<Ghost> ghosts;

  /// Throws std::invalid_argument naming the field and its value.
  void validate() const;
};

}  // namespace occ
