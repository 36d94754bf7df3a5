// SPDX-License-Identifier: Apache-2.0
// Internal: measures the corners of a board near its detected tags.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/landmarks/internal/tag_placement.hpp"
#include "libocc/landmarks/marker_boards.hpp"

namespace occ::internal::landmarks {

/// A corner where two dark and two bright sectors meet. Offsets are from the corner, in the plane
/// of the board [m]; the edges are parallel to x and y.
struct MarkedCorner {
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d dark_m = Eigen::Vector2d::Zero();    ///< offset of a point in a dark sector
  Eigen::Vector2d bright_m = Eigen::Vector2d::Zero();  ///< offset of a point in a bright sector
  double clear_m = 0;  ///< distance of the nearest line that does not pass through the corner
  /// Corners of rectangles whose pixels are not part of the pattern of four sectors; offsets.
  std::vector<std::array<Eigen::Vector2d, 4>> excluded_m;
};

/// A board for the measurement.
struct MarkedBoard {
  std::vector<BoardTag> tags;  ///< sorted by id
  std::vector<MarkedCorner> corners;
  /// Max distance per axis of a corner from the middle of a tag, and from a measured corner, that
  /// predict it.
  double reach_m = 0, step_m = 0;
};

/// Measures the corners within reach of the tags of `placement`.
BoardPoints measure_marked(const Image& grey, const MarkedBoard& board,
                           const std::vector<AprilTag>& detected,
                           const BoardTagPlacement& placement, const MarkerBoardOptions& options);

}  // namespace occ::internal::landmarks
