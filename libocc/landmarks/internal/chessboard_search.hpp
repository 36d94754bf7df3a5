// SPDX-License-Identifier: Apache-2.0
// Search of a chessboard in reduced images, with OpenCV's findChessboardCorners.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/landmarks/chessboard.hpp"

namespace occ::internal::landmarks {

struct CoarseCorners {
  std::vector<Eigen::Vector2d> px;  // in the full image; empty if there is no board
  int factor = 1;                   // of the reduced image in which they were found
};

/// Throws std::invalid_argument if the library is built without OpenCV.
CoarseCorners search_board(const Image& pixels, const ChessboardOptions& options);

}  // namespace occ::internal::landmarks
