// SPDX-License-Identifier: Apache-2.0
// Network from images of one calibration board (a chessboard, a grid of discs, a board with tags):
// each image gets its pose by resection. The board's points are error-free and define the world
// frame. An image may have a part of the points.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/calibrate/start_network.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"

namespace occ {

/// Observed points of the board in one image.
struct BoardImage {
  std::string name;                             ///< label, used in warnings
  int camera = 0;                               ///< index into the list of cameras
  Eigen::Matrix2Xd px;                          ///< 2 x n: points of the board
  std::vector<Eigen::Matrix2d> covariance_px2;  ///< one per point; empty: sigma_px for all
  /// Index of each point among the points of the board, each at most once; empty: all points of the
  /// board in their order.
  std::vector<int> indices{};
};

/// Inner corners of a chessboard [m], 3 x (columns rows), row by row, in the plane z = 0. Throws
/// std::invalid_argument for fewer than 2 columns or rows, or a side that is not positive.
LIBOCC_API Eigen::Matrix3Xd chessboard_points(int columns, int rows, double square_m);

/// Moves the image points of discs from the centres of their ellipses to the images of their
/// centres: pixel += project(centre) - centroid of the projected disc, with the camera and the pose
/// of each image (formation/rim.hpp). `network`: from board_network(), or adjusted. Discs that are
/// not projected whole are not used; their number is returned. Throws std::invalid_argument if
/// `network` has no body, if `radius_m` is not positive, or if the numbers of images and of points
/// differ. `images`: measured centres of the ellipses, as given to board_network().
LIBOCC_API int correct_disc_centres(Network& network, const std::vector<BoardImage>& images,
                                    double radius_m);

/// Approximate pinhole camera from all images of camera 0 (start_pinhole in resection.hpp).
LIBOCC_API Result<Camera> start_pinhole(const Eigen::Matrix3Xd& board_m,
                                        const std::vector<BoardImage>& images, int width,
                                        int height);

/// Min number of points of an image in board_network(). Four points of a plane determine a pose
/// without a check; two more make it redundant.
constexpr int min_board_points = 6;

/// board_m: 3 x n [m]. sigma_px: standard deviation of image points without a covariance. Images
/// with fewer than min_board_points points of a larger board, or without a pose, are left out with
/// a warning. Status: ok; too_few_lamps: no image has a pose, or
/// only one image of a planar board, which does not determine a camera. Throws
/// std::invalid_argument for a camera index out of range, counts that differ, an index that is out
/// of range or occurs twice, or values that are not finite.
LIBOCC_API Result<NetworkStart> board_network(const std::vector<NetworkCamera>& cameras,
                                              const Eigen::Matrix3Xd& board_m,
                                              const std::vector<BoardImage>& images,
                                              double sigma_px = 0.1);

}  // namespace occ
