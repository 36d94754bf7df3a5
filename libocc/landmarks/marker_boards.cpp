// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/marker_boards.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <optional>
#include <sstream>
#include <type_traits>

#include "libocc/core/internal/april_family.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/landmarks/april_tags.hpp"
#include "libocc/landmarks/internal/marked_corners.hpp"
#include "libocc/landmarks/internal/tag_corners.hpp"
#include "libocc/landmarks/internal/tag_placement.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::landmarks;
namespace {

using Eigen::Vector2d;

/// Rectangle between two opposite corners.
std::array<Vector2d, 4> rectangle(const Vector2d& a, const Vector2d& b) {
  return {a, Vector2d(b.x(), a.y()), b, Vector2d(a.x(), b.y())};
}

MarkedBoard marked(const AprilGrid& grid) {
  const double side_m = grid.tag_size_m, gap_m = grid.spacing * side_m;
  const double border_m =
      side_m * grid.border_cells / april_family_width(grid.family, grid.border_cells);
  MarkedBoard board;
  board.tags = grid.tags();
  board.reach_m = 1.5 * (side_m + gap_m);  // corners of the eight tags around a tag, near side
  board.step_m = 1.1 * (side_m + gap_m);
  for (const BoardTag& tag : board.tags)
    for (int k = 0; k < 4; ++k) {
      // Signs of the direction from the corner into the tag.
      const double sx = k == 0 || k == 3 ? 1 : -1, sy = k < 2 ? 1 : -1;
      MarkedCorner corner;
      corner.at_m = tag.corners_m[static_cast<std::size_t>(k)];
      corner.dark_m = 0.5 * border_m * Vector2d(sx, sy);
      corner.bright_m = 0.5 * gap_m * Vector2d(sx, -sy);
      corner.clear_m = side_m;
      const double end_m = side_m - border_m, far_m = 1.2 * side_m;
      corner.excluded_m = {rectangle({sx * border_m, sy * border_m}, {sx * end_m, sy * end_m}),
                           rectangle({-sx * gap_m, -far_m}, {-sx * (gap_m + side_m), far_m}),
                           rectangle({-far_m, -sy * gap_m}, {far_m, -sy * (gap_m + side_m)})};
      board.corners.push_back(std::move(corner));
    }
  return board;
}

MarkedBoard marked(const CharucoBoard& charuco) {
  const double square_m = charuco.square_m, gap_m = 0.5 * (square_m - charuco.marker_m);
  const double far_m = square_m - gap_m;
  MarkedBoard board;
  board.tags = charuco.tags();
  board.reach_m = 1.6 * square_m;  // corners of the squares around a marker's square
  board.step_m = 2.1 * square_m;
  const Eigen::Matrix3Xd points_m = charuco.points_m();
  for (int row = 0; row + 1 < charuco.rows; ++row)
    for (int column = 0; column + 1 < charuco.columns; ++column) {
      MarkedCorner corner;
      corner.at_m = points_m.col(row * (charuco.columns - 1) + column).head<2>();
      // Dark sectors are to the right below and to the left above, or the others.
      const double sy = charuco.is_white(column, row) ? -1 : 1;
      corner.dark_m = 0.25 * square_m * Vector2d(1, sy);
      corner.bright_m = Vector2d(0.5 * square_m, -0.5 * sy * gap_m);
      corner.clear_m = square_m;
      for (const double side : {1.0, -1.0})
        corner.excluded_m.push_back(
            rectangle(side * Vector2d(gap_m, -sy * gap_m), side * Vector2d(far_m, -sy * far_m)));
      board.corners.push_back(std::move(corner));
    }
  return board;
}

/// The brightest of the nine pixels around each pixel. libapriltag joins black regions that touch
/// at corners, as the tags and the squares between them do; white paper separates them here.
Image with_brighter_corners(const Image& grey) {
  Image out = grey;
  const auto filter = [&](const auto& from, auto& to) {
    using Pixel = typename std::decay_t<decltype(from)>::value_type;
    std::vector<Pixel> rows(from.size());
    const int w = grey.width, h = grey.height;
    const auto at = [w](int x, int y) {
      return static_cast<std::size_t>(y) * static_cast<std::size_t>(w) +
             static_cast<std::size_t>(x);
    };
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        rows[at(x, y)] = std::max(
            {from[at(std::max(0, x - 1), y)], from[at(x, y)], from[at(std::min(w - 1, x + 1), y)]});
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x)
        to[at(x, y)] = std::max(
            {rows[at(x, std::max(0, y - 1))], rows[at(x, y)], rows[at(x, std::min(h - 1, y + 1))]});
  };
  if (grey.type == PixelType::u8)
    filter(grey.u8, out.u8);
  else
    filter(grey.u16, out.u16);
  return out;
}

AprilTagOptions tag_options(const MarkerBoardOptions& options, const std::string& family,
                            int border_cells) {
  AprilTagOptions tags;
  tags.family = family;
  tags.border_cells = border_cells;
  tags.decimate = options.decimate;
  tags.threads = options.threads;
  tags.max_hamming = options.max_hamming;
  tags.tile_px = options.tile_px;
  tags.overlap_px = options.overlap_px;
  return tags;
}

/// Refines the corners of a tag that was detected where black is narrower by a pixel.
void refine_shrunk(const Image& grey, double border, AprilTag& tag) {
  constexpr double shrunk_px = 1;  // each side is closer to the middle
  TagCorners corners;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vector2d next = tag.corners_px[(k + 1) % 4], last = tag.corners_px[(k + 3) % 4];
    const Vector2d here = tag.corners_px[k];
    corners.px[k] = here - shrunk_px * ((next - here).normalized() + (last - here).normalized());
    corners.covariance_px2[k] = tag.covariance_px2[k];
  }
  TagCorners better = corners;
  tag.refined = refine_corners(grey, border, better);
  tag.corners_px = tag.refined ? better.px : corners.px;
  tag.covariance_px2 = tag.refined ? better.covariance_px2 : corners.covariance_px2;
}

/// Tags of a grid: those whose corners are separated from the squares between them, and those that
/// are too small for that.
std::vector<AprilTag> grid_tags(const Image& grey, const AprilGrid& grid,
                                const MarkerBoardOptions& options) {
  AprilTagOptions detecting = tag_options(options, grid.family, grid.border_cells);
  detecting.refine = false;
  std::vector<AprilTag> tags = detect_april_tags(with_brighter_corners(grey).view(), detecting);
  const double border =
      static_cast<double>(grid.border_cells) / april_family_width(grid.family, grid.border_cells);
  for (AprilTag& tag : tags) refine_shrunk(grey, border, tag);
  detecting.refine = true;
  for (AprilTag& tag : detect_april_tags(grey.view(), detecting)) {
    const bool is_known = std::any_of(tags.begin(), tags.end(), [&](const AprilTag& other) {
      return other.id == tag.id && (other.centre_px - tag.centre_px).norm() <
                                       0.5 * (tag.corners_px[1] - tag.corners_px[0]).norm();
    });
    if (!is_known) tags.push_back(std::move(tag));
  }
  std::stable_sort(tags.begin(), tags.end(),
                   [](const AprilTag& a, const AprilTag& b) { return a.id < b.id; });
  return tags;
}

/// Position of a pixel in the frame of a tag: (0, 0) is its lower left corner, (1, 1) the upper
/// right one.
Vector2d in_tag(const AprilTag& tag, const Vector2d& px) {
  const std::vector<Vector2d> unit{{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  const Eigen::Matrix3d h = plane_homography({tag.corners_px.begin(), tag.corners_px.end()}, unit);
  return (h * px.homogeneous()).hnormalized();
}

/// Gap between two neighbouring tags, relative to their side. `axis`: 0 if `two` is to the right of
/// `one`, 1 if it is above. The mean as seen by both tags is free of a gradient of the scale.
double gap_between(const AprilTag& one, const AprilTag& two, int axis) {
  const std::array<std::size_t, 2> far =
      axis == 0 ? std::array<std::size_t, 2>{1, 2} : std::array<std::size_t, 2>{3, 2};
  const std::array<std::size_t, 2> near =
      axis == 0 ? std::array<std::size_t, 2>{0, 3} : std::array<std::size_t, 2>{0, 1};
  double sum = 0;
  for (const std::size_t k : {0, 1})
    sum +=
        in_tag(one, two.corners_px[near[k]])[axis] - 1 - in_tag(two, one.corners_px[far[k]])[axis];
  return sum / 4;
}

/// Spacing of the tags in the image, if it contradicts the board's and neighbours agree about it.
std::optional<double> other_spacing(const std::vector<AprilTag>& tags, const AprilGrid& grid) {
  std::map<int, const AprilTag*> by_id;
  for (const AprilTag& tag : tags) by_id[tag.id] = &tag;
  std::vector<double> gaps;
  for (const auto& [id, tag] : by_id) {
    const auto right = by_id.find(id + 1), above = by_id.find(id + grid.columns);
    if (right != by_id.end() && (id + 1) % grid.columns != 0)
      gaps.push_back(gap_between(*tag, *right->second, 0));
    if (above != by_id.end()) gaps.push_back(gap_between(*tag, *above->second, 1));
  }
  constexpr std::size_t min_gaps = 4;
  if (gaps.size() < min_gaps) return std::nullopt;
  const double found = median(gaps);
  std::vector<double> off;
  for (const double gap : gaps) off.push_back(std::abs(gap - found));
  constexpr double sigmas_per_deviation = 1.4826;  // of a normal distribution
  const double sigma = sigmas_per_deviation * median(off);
  // Small errors are those of the print and of wide lenses. In another arrangement, tags that are
  // neighbours on the board are not neighbours in the image.
  constexpr double max_error = 0.02, max_sigmas = 4, max_sigma = 0.15;
  const double limit = max_error + max_sigmas * sigma / std::sqrt(static_cast<double>(gaps.size()));
  if (!(sigma < max_sigma) || !(std::abs(found - grid.spacing) > limit)) return std::nullopt;
  return found;
}

Result<BoardPoints> find_marked(const Image& grey, const MarkedBoard& board,
                                const std::vector<AprilTag>& tags,
                                const MarkerBoardOptions& options) {
  const Result<BoardTagPlacement> placement = place_tags(tags, board.tags);
  Result<BoardPoints> result;
  if (placement.ok()) {
    result.value = measure_marked(grey, board, tags, *placement, options);
    return result;
  }
  result.status = placement.status;
  result.message = placement.message;
  result.value.px.resize(2, 0);
  result.value.foreign_ids = placement->foreign_ids;
  result.value.misplaced_ids = placement->misplaced_ids;
  return result;
}

}  // namespace

void MarkerBoardOptions::validate() const {
  tag_options(*this, "tag36h11", 1).validate();
  require(max_window_px >= 2 && max_window_px <= 100, "max_window_px", max_window_px,
          "between 2 and 100");
  require(model_sigma_px >= 0 && std::isfinite(model_sigma_px), "model_sigma_px", model_sigma_px,
          "zero or positive");
}

Result<BoardPoints> find_april_grid(const ImageView& image, const AprilGrid& board,
                                    const MarkerBoardOptions& options) {
  board.validate();
  options.validate();
  image.validate();
  const Image grey = to_grey(image);
  const std::vector<AprilTag> tags = grid_tags(grey, board, options);
  Result<BoardPoints> result = find_marked(grey, marked(board), tags, options);
  if (const auto spacing = other_spacing(tags, board)) {
    std::ostringstream message;
    message << "the gaps between the tags are " << std::setprecision(2) << *spacing
            << " of their side, not " << board.spacing << ": check the spacing";
    result = Result<BoardPoints>{{}, Status::degenerate, message.str()};
    result.value.px.resize(2, 0);
    return result;
  }
  if (!result.ok() && board.border_cells == 2 &&
      !detect_april_tags(grey.view(), tag_options(options, board.family, 1)).empty())
    result.message += "; the image has tags with a border of one cell: border_cells = 1";
  return result;
}

Result<BoardPoints> find_charuco(const ImageView& image, const CharucoBoard& board,
                                 const MarkerBoardOptions& options) {
  board.validate();
  options.validate();
  image.validate();
  const Image grey = to_grey(image);
  const std::vector<AprilTag> tags =
      detect_april_tags(grey.view(), tag_options(options, board.family, 1));
  if (board.rows % 2 == 0) {
    // Most tags of one layout fit the other one, moved by a column.
    CharucoBoard other = board;
    other.legacy = !board.legacy;
    const Result<BoardTagPlacement> own = place_tags(tags, board.tags());
    const Result<BoardTagPlacement> others = place_tags(tags, other.tags());
    if (others.ok() && others->tags.size() > own->tags.size()) {
      Result<BoardPoints> result;
      result.status = Status::degenerate;
      result.message = board.legacy ? "the board does not have the layout `legacy`"
                                    : "the board has the layout of OpenCV before 4.6 (`legacy`)";
      result.value.px.resize(2, 0);
      return result;
    }
  }
  return find_marked(grey, marked(board), tags, options);
}

}  // namespace occ
