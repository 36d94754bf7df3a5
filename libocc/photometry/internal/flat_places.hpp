// SPDX-License-Identifier: Apache-2.0
// Places of an exposure series that are flat but for noise, with the noise that they show.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/image.hpp"

namespace occ::internal::photometry {

/// A place in one image.
struct PlaceLevel {
  int exposure = 0;
  double level_dn = 0;      ///< mean of the pixels
  double variance_dn2 = 0;  ///< of the mean
  double pixel_dn2 = 0;     ///< noise variance of one pixel, the rounding left out
};

struct FlatPlace {
  double x = 0, y = 0;             ///< its middle
  std::vector<PlaceLevel> levels;  ///< by image; only where no pixel is black or clipped
};

struct LevelRange {
  double black_dn = 0, full_scale_dn = 255;
};

/// At most `count` places that are neither black nor clipped in two images or more.
std::vector<FlatPlace> flat_places(const std::vector<ImageView>& images, int channel,
                                   const LevelRange& range, int count);

}  // namespace occ::internal::photometry
