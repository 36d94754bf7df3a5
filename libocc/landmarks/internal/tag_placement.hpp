// SPDX-License-Identifier: Apache-2.0
// Internal: assigns detected tags to the tags of a board. Two tags agree if the homography of each
// predicts the other at its place. The largest set of tags that are linked by agreement is the
// board; perspective and lens distortion need no model, because neighbours agree in pairs.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "libocc/scene/marker_boards.hpp"

namespace occ::internal::landmarks {

/// A tag of the board in the image.
struct PlacedTag {
  std::size_t detected = 0;  ///< index into the detected tags
  std::size_t on_board = 0;  ///< index into the tags of the board
};

/// Result of place_tags().
struct BoardTagPlacement {
  std::vector<PlacedTag> tags;     ///< sorted by id
  std::vector<int> foreign_ids;    ///< tags that the board does not have, sorted
  std::vector<int> misplaced_ids;  ///< tags with an id of the board elsewhere, sorted
};

/// Homography from the plane of the board [m] to pixels: least squares over corners of tags.
Eigen::Matrix3d plane_homography(const std::vector<Eigen::Vector2d>& plane_m,
                                 const std::vector<Eigen::Vector2d>& px);

/// Status: ok; too_few_lamps: no tag of the board; ambiguous: several boards; degenerate: the tags
/// have another arrangement than the board's. `board`: its tags by id, 0, 1, ...
Result<BoardTagPlacement> place_tags(const std::vector<AprilTag>& detected,
                                     const std::vector<BoardTag>& board);

/// "3, 5 and 7"; at most eight ids, then "and 12 more".
std::string id_list(const std::vector<int>& ids);

}  // namespace occ::internal::landmarks
