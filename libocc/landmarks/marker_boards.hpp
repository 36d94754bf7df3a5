// SPDX-License-Identifier: Apache-2.0
// Detects boards whose tags number their points (scene/marker_boards.hpp): grids of AprilTags and
// ChArUco boards. A part of the board suffices, as in a corner of the image or behind an object.
//
// Tags are detected and compared with the board. A point is predicted by a homography from the
// nearest tags, so perspective and lens distortion need no model of the whole board. It is then
// measured as the inner corner of a chessboard: by a fit of two blurred edges that cross
// (internal/corner_fit.hpp), whose window leaves out the bits of the tags. Four sectors meet at the
// points of both boards. Edges that the lens bends are fitted with the bend of the lines through
// neighbouring points. A fit whose sectors do not have the tones of a corner is rejected: the
// point is covered. Measured points predict the points around them in turn, so tags that cannot be
// read, for example at the border of the image, do not hide their corners.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/scene/marker_boards.hpp"

namespace occ {

/// Options of find_april_grid() and find_charuco().
struct LIBOCC_API MarkerBoardOptions {
  double decimate = 1;           ///< as in AprilTagOptions; 2 misses tags below about 30 px
  int threads = 1;               ///< number of threads of the search of tags, at least 1
  int max_hamming = 1;           ///< max number of corrected bits of a tag, 0 to 2
  double max_window_px = 10;     ///< max radius of the window around a point in a sharp image
  double model_sigma_px = 0.01;  ///< sigma per axis of errors that points of the image share
  int tile_px = 0;       ///< as in AprilTagOptions: side of the tiles for a very large image
  int overlap_px = 400;  ///< overlap of the tiles; larger than any tag with its border

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Points of a board that were measured in an image.
struct BoardPoints {
  std::vector<int> indices;                     ///< columns of points_m() of the board, increasing
  Eigen::Matrix2Xd px;                          ///< 2 x n, in the order of `indices`
  std::vector<Eigen::Matrix2d> covariance_px2;  ///< one per point
  /// Sigma per axis of the scatter about a smooth grid that the fits do not explain. It is part of
  /// the covariances.
  double scatter_sigma_px = 0;
  int tags = 0;  ///< number of tags of the board that were detected
  /// Number of predicted points inside the image that were not measured, because something covers
  /// them, or in glare.
  int hidden = 0;
  std::vector<int> foreign_ids;    ///< detected tags that the board does not have; ignored
  std::vector<int> misplaced_ids;  ///< tags with an id of the board at another place; ignored
};

/// Points are numbered 4 id + corner; corners are in the order of AprilTag::corners_px. Status: ok;
/// too_few_lamps: no tag of the board was detected; ambiguous: several boards are in the image;
/// degenerate: the tags are arranged in another way, or have another spacing. Throws
/// std::invalid_argument for an invalid view, board or option.
LIBOCC_API Result<BoardPoints> find_april_grid(const ImageView& image, const AprilGrid& board,
                                               const MarkerBoardOptions& options = {});

/// Points are the inner corners of the chessboard, numbered row by row as in OpenCV. Status and
/// exceptions as find_april_grid().
LIBOCC_API Result<BoardPoints> find_charuco(const ImageView& image, const CharucoBoard& board,
                                            const MarkerBoardOptions& options = {});

}  // namespace occ
