// SPDX-License-Identifier: Apache-2.0
// Detects the inner corners of a chessboard and measures them with covariances.
//
// Corners are saddle points of the image, reduced by several factors in turn. They are linked along
// the edges of the squares (internal/saddles.hpp, corner_grid.hpp), so perspective and lens
// distortion need no model. A board with squares of about 5 px is found if its contrast is 3 of 255
// grey levels or more. Single corners may be weak, as in glare: they are searched where their
// neighbours predict them.
//
// A corner is then measured in the full image, by a fit of two blurred edges that cross in uneven
// light (internal/corner_fit.hpp). The window around a corner stays within the four squares that
// meet there. Rows and columns that the lens bends are fitted with their bend. Its covariance
// follows from the residuals of the fit, with their correlation, and from the scatter of the
// corners about a smooth grid.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ {

/// Options of find_chessboard().
struct LIBOCC_API ChessboardOptions {
  int columns = 9, rows = 6;     ///< number of inner corners
  double max_window_px = 10;     ///< max radius of the window in a sharp image; smaller on small
                                 ///< squares, larger if three times the blur is more
  double model_sigma_px = 0.01;  ///< sigma per axis of errors that corners of the image share
                                 ///< (uneven light, bent paper)
  /// Called before the search in each reduced image; false stops the search without a result.
  std::function<bool(int searches_done, int searches)> progress;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Inner corners of a chessboard.
struct ChessboardCorners {
  /// Row by row, 2 x (columns rows). Columns and rows are right-handed. The square before the first
  /// corner is black if an orientation of the board has a black square there. If two orientations
  /// have, the rows run more to the right in the image.
  Eigen::Matrix2Xd px;
  std::vector<Eigen::Matrix2d> covariance_px2;  ///< one per corner
  /// Sigma per axis of the scatter about a smooth grid that the fits do not explain. It is part of
  /// the covariances.
  double scatter_sigma_px = 0;
  /// Number of corners whose fit failed, for example in glare. They have the position in the
  /// reduced image, with a sigma of 0.3 of its pixels, or, if they are hidden, the position that
  /// their neighbours predict, with a sigma of a tenth of the square.
  int unfitted = 0;
};

/// Empty if the whole board is not visible, or if the image has a board with more corners. Throws
/// std::invalid_argument for an invalid view or option.
LIBOCC_API std::optional<ChessboardCorners> find_chessboard(const ImageView& image,
                                                            const ChessboardOptions& options = {});

}  // namespace occ
