// SPDX-License-Identifier: Apache-2.0
// Internal: a large image divided into tiles that overlap, and whose middle parts do not.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::landmarks {

/// Pixels x0 <= x < x0 + width and rows alike; of what is found there that counts whose centre lies
/// in the tile's middle part, up to half the overlap from the borders (all the way at the image's).
struct ImageTile {
  /// By which middle parts do overlap: rounding may not lose what lies on their border.
  static constexpr double tolerance_px = 1;

  int x0 = 0, y0 = 0, width = 0, height = 0;
  Eigen::Vector2d low = Eigen::Vector2d::Zero(), high = Eigen::Vector2d::Zero();

  bool counts(const Eigen::Vector2d& px) const {
    return ((px - low).array() >= -tolerance_px).all() &&
           ((high - px).array() >= -tolerance_px).all();
  }
};

/// Tiles of about tile_px, row by row, that begin at multiples of `unit`; all of the image when it
/// is no larger. tile_px >= 2 overlap_px.
std::vector<ImageTile> image_tiles(int width, int height, int tile_px, int overlap_px, int unit);

}  // namespace occ::internal::landmarks
