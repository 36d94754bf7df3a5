// SPDX-License-Identifier: Apache-2.0
// Inner corners of a chessboard, by OpenCV's findChessboardCorners, then measured again: a corner c
// is where the image's gradient g at every p around it is across the line from c to p (Foerstner,
// Guelch, "A fast operator for detection and precise location of distinct points ...", ISPRS
// Intercommission Workshop, 1987, section 3; as OpenCV's cornerSubPix),
//
//     sum of w (g g^T) (p - c) = 0,
//
// and its covariance is what the image's noise, itself measured, does to that sum. A window about
// the corner stays within the four squares that meet there.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ {

struct LIBOCC_API ChessboardOptions {
  int columns = 9, rows = 6;     ///< of inner corners
  double max_window_px = 10;     ///< half the side of the window at most; less on small squares
  double model_sigma_px = 0.02;  ///< per axis: of what is no noise (uneven light, bent paper)

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct ChessboardCorners {
  Eigen::Matrix2Xd px;  ///< row by row; the first is that of any corner of a symmetric board
  std::vector<Eigen::Matrix2d> covariance_px2;
};

/// Nothing when the whole board is not seen. Throws std::invalid_argument for a bad view or bad
/// options.
LIBOCC_API std::optional<ChessboardCorners> find_chessboard(const ImageView& image,
                                                            const ChessboardOptions& options = {});

}  // namespace occ
