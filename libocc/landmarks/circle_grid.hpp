// SPDX-License-Identifier: Apache-2.0
// Detects a grid of discs on a calibration board, symmetric or asymmetric, and measures the images
// of the discs with covariances.
//
// The image of a disc is an ellipse (without lens distortion), and its centre is not the image of
// the disc's centre. For a disc of radius r at the distance Z, tilted by t, the difference is about
// f (r / Z)^2 sin(t) cos(t) (formation/rim.hpp). It is not corrected here, because it depends on
// the pose: board_network() of calibrate/board_network.hpp corrects it by the exact projection of
// the disc. The outline is fitted as a whole (internal/circle_outline.hpp), so uneven light does
// not shift the centre as it shifts a centroid of grey levels.
//
// Discs are searched in images reduced to at most 2400 px per side, where they must have a diameter
// of 5 px or more.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ {

/// Options of find_circle_grid().
struct LIBOCC_API CircleGridOptions {
  int columns = 4, rows = 11;  ///< number of discs of a row, and of rows
  /// True: odd rows are shifted by half the distance of the discs of a row, and rows are that half
  /// distance apart, so that each disc has four neighbours on the diagonals.
  bool asymmetric = true;
  double model_sigma_px = 0.01;  ///< sigma per axis of errors that discs of the image share
  /// Called before the search in each reduced image; false stops the search without a result.
  std::function<bool(int searches_done, int searches)> progress;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Images of the discs of a grid.
struct CircleGridPoints {
  /// Centres of the ellipses, 2 x (columns rows), row by row. Columns and rows are right-handed. If
  /// the grid has a symmetry, the rows run more to the right in the image.
  Eigen::Matrix2Xd px;
  std::vector<Eigen::Matrix2d> covariance_px2;  ///< one per disc
  bool dark = true;                             ///< true: discs are darker than their surroundings
  /// Sigma per axis of the scatter about a smooth grid that the fits do not explain. It is part of
  /// the covariances.
  double scatter_sigma_px = 0;
  /// Number of discs whose outline could not be fitted, for example in glare. They have the
  /// centroid in the reduced image, with a sigma of 0.3 of its pixels.
  int unfitted = 0;
};

/// Positions of the discs' centres, 2 x (columns rows), row by row: (column, row) spacing, or
/// (2 column + row % 2, row) spacing if asymmetric. Throws std::invalid_argument for an argument
/// that is not positive.
LIBOCC_API Eigen::Matrix2Xd circle_grid_positions(int columns, int rows, bool asymmetric,
                                                  double spacing);

/// Empty if the whole grid is not visible, or if the image has a grid with more discs. Throws
/// std::invalid_argument for an invalid view or option.
LIBOCC_API std::optional<CircleGridPoints> find_circle_grid(const ImageView& image,
                                                            const CircleGridOptions& options = {});

}  // namespace occ
