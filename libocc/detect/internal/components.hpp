// SPDX-License-Identifier: Apache-2.0
// Internal: the one pass over the image. Runs of pixels above the local threshold are joined to
// those of the row above (8-connected, union-find) and their moments added up on the way: nothing
// is visited twice, and memory holds only what still grows and what is kept.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/detect/internal/background.hpp"
#include "libocc/detect/internal/component.hpp"

namespace occ::internal::detect {

struct ThresholdRule {
  double sigma = 5;                ///< above the local background
  std::optional<double> level_dn;  ///< instead of it: the same threshold everywhere
  double full_scale_dn = 255;      ///< a channel at or above it counts as saturated
  int min_area_px = 1;             ///< smaller components are dropped
  std::size_t keep = 65536;        ///< at most about so many, the brightest; bounds the memory
};

/// Components of a valid view, in an order that depends on the image alone.
std::vector<Component> find_components(const ImageView& image, const Background& background,
                                       const ThresholdRule& rule);

}  // namespace occ::internal::detect
