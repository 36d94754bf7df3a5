// SPDX-License-Identifier: Apache-2.0
// Internal: assembles corners of a chessboard to a grid, by local relations only. Lens distortion
// and perspective therefore need no model. Two corners are neighbours if an edge leads straight
// from one to the other, with its bright side on the same side all along. The colours of the
// sectors alternate from corner to corner, so a missing corner is not skipped. (Geiger, Moosmann,
// Car, Schuster, "Automatic camera and range sensor calibration using a single shot", ICRA 2012,
// section III, grow such grids.)
#pragma once

#include <optional>
#include <vector>

#include "libocc/landmarks/internal/saddles.hpp"

namespace occ::internal::landmarks {

/// All corners of a board, row by row. Columns, rows and viewing direction are right-handed.
struct CornerGrid {
  int columns = 0, rows = 0;
  std::vector<SaddleCorner> corners;

  const SaddleCorner& at(int column, int row) const {
    return corners[static_cast<std::size_t>(row * columns + column)];
  }
};

/// Finds the board of columns x rows corners. The first square is black if an orientation of the
/// board has a black first square; of two such orientations, that with its rows more to the right
/// in the image is chosen. nullopt if the board is not complete, or if the grid contains it at
/// several places, which means that the real board is larger.
std::optional<CornerGrid> find_grid(const GreyLevel& level,
                                    const std::vector<SaddleCorner>& corners, int columns,
                                    int rows);

}  // namespace occ::internal::landmarks
