// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/marker_boards.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/april_family.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::core;
namespace {

using Eigen::Vector2d;

/// Checks the family, and that it has enough tags.
void check_family(const std::string& board, const std::string& family, int tags) {
  std::string names;
  const std::vector<std::string> known = bordered_family_names();
  for (const std::string& name : known) names += (names.empty() ? "" : ", ") + name;
  require(std::count(known.begin(), known.end(), family) > 0, board + ": family", family,
          "one of " + names +
              " (OpenCV's dictionaries DICT_APRILTAG_36h11 to 16h5; markers of its other "
              "dictionaries are not detected)");
  require(tags <= april_family_size(family), board + ": columns, rows", tags,
          "a board of at most " + std::to_string(april_family_size(family)) +
              " tags, the number of tags of " + family);
}

}  // namespace

void AprilGrid::validate() const {
  const std::string board = "aprilgrid";
  require(columns >= 1 && columns <= 100, board + ": columns", columns, "between 1 and 100");
  require(rows >= 1 && rows <= 100, board + ": rows", rows, "between 1 and 100");
  require(tag_size_m > 0 && std::isfinite(tag_size_m), board + ": tag_size_m", tag_size_m,
          "positive");
  require(spacing > 0 && spacing <= 2, board + ": spacing", spacing,
          "positive and at most 2: the gap between tags relative to their side");
  require(border_cells >= 1 && border_cells <= 4, board + ": border_cells", border_cells,
          "between 1 and 4");
  check_family(board, family, columns * rows);
}

std::vector<BoardTag> AprilGrid::tags() const {
  const double pitch_m = tag_size_m * (1 + spacing), side_m = tag_size_m;
  std::vector<BoardTag> all;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      const Vector2d at = pitch_m * Vector2d(column, row);
      all.push_back({row * columns + column,
                     {at, at + Vector2d(side_m, 0), at + Vector2d(side_m, side_m),
                      at + Vector2d(0, side_m)}});
    }
  return all;
}

Eigen::Matrix3Xd AprilGrid::points_m() const {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Zero(3, 4 * columns * rows);
  Eigen::Index k = 0;
  for (const BoardTag& tag : tags())
    for (const Vector2d& corner : tag.corners_m) points.col(k++).head<2>() = corner;
  return points;
}

void CharucoBoard::validate() const {
  const std::string board = "charuco";
  require(columns >= 3 && columns <= 100, board + ": columns", columns, "between 3 and 100");
  require(rows >= 3 && rows <= 100, board + ": rows", rows, "between 3 and 100");
  require(square_m > 0 && std::isfinite(square_m), board + ": square_m", square_m, "positive");
  require(marker_m > 0 && std::isfinite(marker_m), board + ": marker_m", marker_m, "positive");
  require(marker_m < square_m, board + ": marker_m", marker_m,
          "smaller than square_m, the square around it");
  check_family(board, family, columns * rows / 2);
}

std::vector<BoardTag> CharucoBoard::tags() const {
  const double gap_m = 0.5 * (square_m - marker_m), far_m = gap_m + marker_m;
  std::vector<BoardTag> all;
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      if (!is_white(column, row)) continue;
      const Vector2d at = square_m * Vector2d(column, row);
      // The tag is upside down: its lower left corner is the upper right one on the board.
      all.push_back({static_cast<int>(all.size()),
                     {at + Vector2d(far_m, gap_m), at + Vector2d(gap_m, gap_m),
                      at + Vector2d(gap_m, far_m), at + Vector2d(far_m, far_m)}});
    }
  return all;
}

Eigen::Matrix3Xd CharucoBoard::points_m() const {
  Eigen::Matrix3Xd points(3, (columns - 1) * (rows - 1));
  for (int row = 0; row + 1 < rows; ++row)
    for (int column = 0; column + 1 < columns; ++column)
      points.col(row * (columns - 1) + column) = square_m * Eigen::Vector3d(column + 1, row + 1, 0);
  return points;
}

}  // namespace occ
