// SPDX-License-Identifier: Apache-2.0
// Detects the inner corners of a chessboard with OpenCV's findChessboardCorners and refines them.
// At a corner c, the image gradient g at every point p around it is perpendicular to p - c
// (Foerstner, Guelch, "A fast operator for detection and precise location of distinct points,
// corners and centres of circular features", ISPRS Intercommission Conference on Fast Processing of
// Photogrammetric Data, 1987, section 3; also OpenCV's cornerSubPix):
//
//     sum of w (g g^T) (p - c) = 0.
//
// The search runs in the image reduced to at most 1000 px per side, with OpenCV's quick rejection
// of images without a board, which also rejects boards with small squares; then without it in at
// most 640 px. A board with squares of less than 5 px in the latter may be missed. OpenCV's search
// takes a time that grows quickly with the size if there is no board: 6 s for noise of 640 x 480
// px, 44 s for 1000 x 750 px. Corners are refined in the full image.
//
// The covariance of c follows from propagating the image noise, estimated from the image, through
// this sum. The window around a corner stays within the four squares that meet there.
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
  double max_window_px = 10;     ///< max half side of the window; smaller on small squares
  double model_sigma_px = 0.02;  ///< sigma per axis of errors other than noise (uneven light, bent
                                 ///< paper)
  /// Called before the search in each reduced image; false stops the search without a result.
  std::function<bool(int searches_done, int searches)> progress;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Inner corners of a chessboard.
struct ChessboardCorners {
  Eigen::Matrix2Xd px;  ///< row by row; the first may be any outer corner of a symmetric board
  std::vector<Eigen::Matrix2d> covariance_px2;  ///< one per corner
};

/// Empty if the whole board is not visible. Throws std::invalid_argument for an invalid view or
/// option, and in a build without OpenCV (CMake option LIBOCC_OPENCV).
LIBOCC_API std::optional<ChessboardCorners> find_chessboard(const ImageView& image,
                                                            const ChessboardOptions& options = {});

}  // namespace occ
