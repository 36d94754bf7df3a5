// SPDX-License-Identifier: Apache-2.0
// Calibration boards whose AprilTags number their points, so that a part of the board suffices.
// Data only.
//
// AprilGrid: the grid of tags of Kalibr (Furgale, Rehder, Siegwart, "Unified temporal and spatial
// calibration for multi-sensor systems", IROS 2013; file format: Kalibr's wiki, "Calibration
// targets"). Ids run row by row from the lower left tag. A black square of the size of the gap is
// between the corners of neighbouring tags, so that four sectors meet at each corner of a tag.
//
// ChArUco: the chessboard of OpenCV whose white squares have markers (Garrido-Jurado et al.,
// "Automatic generation and detection of highly reliable fiducial markers under occlusion", Pattern
// Recognition 47, 2014, for the markers). The markers must be of one of OpenCV's dictionaries
// DICT_APRILTAG_36h11, 36h10, 25h9 or 16h5, the families tag36h11 to tag16h5 here. OpenCV prints
// these tags upside down.
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// A tag of a board. Corners are in the plane of the board [m], in the order of
/// AprilTag::corners_px: lower left, lower right, upper right, upper left of the upright tag.
struct BoardTag {
  int id = 0;                                  ///< number within its family
  std::array<Eigen::Vector2d, 4> corners_m{};  ///< x and y in the frame of the board
};

/// Grid of AprilTags. Frame: origin at the lower left corner of tag 0, x to the right, y up, z
/// towards the viewer.
struct LIBOCC_API AprilGrid {
  int columns = 6, rows = 6;        ///< number of tags of a row, and of rows
  double tag_size_m = 0;            ///< side of a tag's black square
  double spacing = 0.3;             ///< gap between tags, relative to tag_size_m
  std::string family = "tag36h11";  ///< tag36h11, tag36h10, tag25h9 or tag16h5
  int border_cells = 2;             ///< width of the tags' black border, 1 to 4; Kalibr prints 2

  void validate() const;  ///< throws std::invalid_argument naming the field and its value

  /// The tags by id: row by row from the lower left one.
  std::vector<BoardTag> tags() const;
  /// Points of the board, 3 x (4 columns rows) [m]: the four corners of each tag.
  Eigen::Matrix3Xd points_m() const;
};

/// Chessboard with markers in its white squares. Frame: origin at the upper left corner of the
/// upper left square, x to the right, y down, z away from the viewer, as in OpenCV.
struct LIBOCC_API CharucoBoard {
  int columns = 5, rows = 7;        ///< number of squares of a row, and of rows
  double square_m = 0;              ///< side of a square
  double marker_m = 0;              ///< side of a marker's black square
  std::string family = "tag36h11";  ///< tag36h11, tag36h10, tag25h9 or tag16h5
  /// Layout of OpenCV before version 4.6 (setLegacyPattern): the upper left square is white if the
  /// number of rows is even. Without it, the upper left square is black. Boards with an odd number
  /// of rows have one layout.
  bool legacy = false;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value

  /// True if a square is white and has a marker. Column and row count from the upper left square.
  bool is_white(int column, int row) const {
    return (column + row) % 2 == (legacy && rows % 2 == 0 ? 0 : 1);
  }
  /// The markers by id: row by row from the upper left one.
  std::vector<BoardTag> tags() const;
  /// Points of the board, 3 x ((columns - 1) (rows - 1)) [m]: the inner corners of the chessboard,
  /// row by row from the upper left one.
  Eigen::Matrix3Xd points_m() const;
};

}  // namespace occ
