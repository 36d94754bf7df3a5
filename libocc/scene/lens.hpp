// SPDX-License-Identifier: Apache-2.0
// Effects of a lens on the light, besides the projection; none by default. Data only.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// A faint second image of everything, from two reflections inside the lens. A point at p appears a
/// second time at c + scale (p - c), where c is the principal point.
struct Ghost {
  double strength = 0;  ///< part of the light that goes into the second image
  double scale = -1;    ///< negative (the usual case): rotated by 180 degrees
  double blur_px = 0;   ///< standard deviation of its own blur, in addition to the lens's
};

/// Properties of a lens besides its projection.
struct LIBOCC_API Lens {
  /// Adds a Gaussian blur of 0.42 wavelength x f-number to the PSF (core of the Airy disc).
  bool diffraction = false;
  /// Lamps nearer or farther than this are blurred by a disc; none: everything is in focus.
  std::optional<double> focus_distance_m;
  /// a1, a2, ... of the transmission 1 + a1 q^2 + a2 q^4 + ..., where q is the distance from the
  /// principal point over that of the image's farthest corner. The transmission must be in (0, 1]
  /// over the image. The cos^4 law is modelled separately.
  std::vector<double> vignetting;
  double veiling_glare = 0;   ///< part of the lamps' light that spreads evenly over the image
  std::vector<Ghost> ghosts;  ///< each is rendered once

  /// Throws std::invalid_argument naming the field and its value.
  void validate() const;
};

}  // namespace occ
