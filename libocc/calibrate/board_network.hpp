// SPDX-License-Identifier: Apache-2.0
// A network from images of one board of known points (a chessboard), the usual calibration of a
// camera: each image gets its pose by resection, the board is the world and known without error.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/calibrate/start_network.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"

namespace occ {

struct BoardImage {
  std::string name;
  int camera = 0;
  Eigen::Matrix2Xd px;                          ///< of all of the board's points, in their order
  std::vector<Eigen::Matrix2d> covariance_px2;  ///< empty: of sigma_px
};

/// Inner corners of a chessboard [m], row by row, in the plane z = 0.
LIBOCC_API Eigen::Matrix3Xd chessboard_points(int columns, int rows, double square_m);

/// A pinhole that fits the boards of all images of camera 0 about (resection.hpp: start_pinhole).
LIBOCC_API Result<Camera> start_pinhole(const Eigen::Matrix3Xd& board_m,
                                        const std::vector<BoardImage>& images, int width,
                                        int height);

/// board_m: columns. Images without a pose are left out with a warning. Status: ok; too_few_lamps:
/// no image has a pose, or a single one of a board in a plane, which determines no camera. Throws
/// std::invalid_argument for a bad camera index, counts that differ, values that are not finite.
LIBOCC_API Result<NetworkStart> board_network(const std::vector<NetworkCamera>& cameras,
                                              const Eigen::Matrix3Xd& board_m,
                                              const std::vector<BoardImage>& images,
                                              double sigma_px = 0.1);

}  // namespace occ
