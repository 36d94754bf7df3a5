// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/corner_links.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <queue>

namespace occ::internal::landmarks {
namespace {

using Eigen::Vector2d;

// Cosine of 15 degrees: error of an edge's direction on the small circle, where noise moves a
// crossing by half a pixel of 2.5 px.
constexpr double min_edge_cosine = 0.966;

/// Corners by the cells of a raster, to find the nearest ones.
class CornerRaster {
 public:
  CornerRaster(const GreyLevel& level, const std::vector<SaddleCorner>& corners)
      : corners_(corners) {
    const double area = static_cast<double>(level.width()) * level.height();
    cell_px_ = std::max(1.0, std::sqrt(2 * area / static_cast<double>(corners.size())));
    columns_ = 1 + static_cast<int>(level.width() / cell_px_);
    rows_ = 1 + static_cast<int>(level.height() / cell_px_);
    cells_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const auto [x, y] = cell_of(corners[i].px);
      cells_[index(x, y)].push_back(i);
    }
  }

  /// Nearest other corners of comparable contrast, by increasing distance.
  std::vector<std::size_t> near(std::size_t i) const {
    // In a board that is tilted by 75 degrees, three corners of the same row are nearer than one
    // of the next row; the rest is for false corners.
    constexpr std::size_t max_count = 24;
    constexpr double min_contrast = 0.1;  // edge of a shadow, or glare, between neighbours
    std::vector<std::pair<double, std::size_t>> found;
    const auto [cx, cy] = cell_of(corners_[i].px);
    const int rings = std::max(columns_, rows_);
    int last = rings;
    for (int ring = 0; ring <= last && ring <= rings; ++ring) {
      for (int y = cy - ring; y <= cy + ring; ++y) {
        if (y < 0 || y >= rows_) continue;
        const bool whole_row = y == cy - ring || y == cy + ring;
        const int step = whole_row || ring == 0 ? 1 : 2 * ring;
        for (int x = cx - ring; x <= cx + ring; x += step) {
          if (x < 0 || x >= columns_) continue;
          for (const std::size_t j : cells_[index(x, y)])
            if (j != i && corners_[j].contrast > min_contrast * corners_[i].contrast &&
                corners_[i].contrast > min_contrast * corners_[j].contrast)
              found.emplace_back((corners_[j].px - corners_[i].px).squaredNorm(), j);
        }
      }
      // Corners of farther rings may still be nearer than some of those found so far.
      if (last == rings && found.size() >= max_count) last = ring + 1 + ring / 2;
    }
    const auto count = std::min(found.size(), max_count);
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count),
                      found.end());
    found.resize(count);
    std::vector<std::size_t> indices;
    for (const auto& [distance2, j] : found) indices.push_back(j);
    return indices;
  }

 private:
  std::pair<int, int> cell_of(const Vector2d& p) const {
    return {std::clamp(static_cast<int>(p.x() / cell_px_), 0, columns_ - 1),
            std::clamp(static_cast<int>(p.y() / cell_px_), 0, rows_ - 1)};
  }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(x);
  }

  const std::vector<SaddleCorner>& corners_;
  double cell_px_ = 1;
  int columns_ = 1, rows_ = 1;
  std::vector<std::vector<std::size_t>> cells_;
};

/// End of a link: a corner and its edge. corner < 0: none.
struct LinkEnd {
  std::int64_t corner = -1;
  int edge = 0;
};

using CornerLinks = std::vector<std::array<LinkEnd, 4>>;

/// True if the edge from `a` to `b` has its bright side where edge `edge` of `a` has it.
bool edge_continues(const GreyLevel& level, const SaddleCorner& a, const SaddleCorner& b,
                    int edge) {
  constexpr double parts[] = {0.3, 0.5, 0.7};  // clear of the blur of both corners
  constexpr double side_part = 0.2, min_side_px = 1, max_side_px = 6;
  constexpr double min_step = 0.25;  // of the contrast: uneven light along the edge
  const Vector2d between = b.px - a.px;
  const double length = between.norm();
  const double side_px = std::clamp(side_part * length, min_side_px, max_side_px);
  const Vector2d across = side_px / length * Vector2d(-between.y(), between.x());
  const double sign = edge % 2 == 0 ? 1 : -1;
  const double min_difference = min_step * std::min(a.contrast, b.contrast);
  for (const double part : parts) {
    const Vector2d p = a.px + part * between;
    if (!level.holds(p, side_px)) return false;
    if (!(sign * (level.at(p + across) - level.at(p - across)) > min_difference)) return false;
  }
  return true;
}

/// The nearest corner along each edge of each corner.
CornerLinks nearest_along_edges(const GreyLevel& level, const std::vector<SaddleCorner>& corners) {
  constexpr double min_length_px = 3;  // nearer corners are one, found twice
  const CornerRaster raster(level, corners);
  CornerLinks links(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const SaddleCorner& a = corners[i];
    for (const std::size_t j : raster.near(i)) {
      const SaddleCorner& b = corners[j];
      const Vector2d between = b.px - a.px;
      if (!(between.norm() > min_length_px)) continue;
      const int edge = edge_along(a, between, min_edge_cosine);
      if (edge < 0 || links[i][static_cast<std::size_t>(edge)].corner >= 0) continue;
      const int back = edge_along(b, -between, min_edge_cosine);
      if (back < 0 || (back - edge) % 2 == 0 || !edge_continues(level, a, b, edge)) continue;
      links[i][static_cast<std::size_t>(edge)] = {static_cast<std::int64_t>(j), back};
    }
  }
  return links;
}

bool is_mutual(const CornerLinks& links, std::size_t i, int edge) {
  const LinkEnd& end = links[i][static_cast<std::size_t>(edge)];
  if (end.corner < 0) return false;
  const LinkEnd& back =
      links[static_cast<std::size_t>(end.corner)][static_cast<std::size_t>(end.edge)];
  return back.corner == static_cast<std::int64_t>(i) && back.edge == edge;
}

/// Place of a corner in its grid. Edge k leads to the direction (k + turn) % 4 of +u, +v, -u, -v.
struct GridPlace {
  int u = 0, v = 0, turn = 0;
};

/// Corners that are linked with `seed`; they are removed from `is_free`.
LinkedGrid grid_from(std::size_t seed, const CornerLinks& links, std::vector<bool>& is_free) {
  constexpr int du[] = {1, 0, -1, 0}, dv[] = {0, 1, 0, -1};
  LinkedGrid grid;
  std::map<std::size_t, GridPlace> places{{seed, {}}};
  std::queue<std::size_t> open;
  open.push(seed);
  grid[{0, 0}] = seed;
  is_free[seed] = false;
  while (!open.empty()) {
    const std::size_t i = open.front();
    open.pop();
    const GridPlace at = places[i];
    for (int edge = 0; edge < 4; ++edge) {
      if (!is_mutual(links, i, edge)) continue;
      const LinkEnd& end = links[i][static_cast<std::size_t>(edge)];
      const auto j = static_cast<std::size_t>(end.corner);
      const int direction = (edge + at.turn) % 4;
      const GridPlace next{at.u + du[direction], at.v + dv[direction],
                           (direction + 2 - end.edge + 4) % 4};
      // A contradiction is a false corner: the first one to claim the place keeps it.
      if (!is_free[j] || !grid.emplace(std::pair(next.u, next.v), j).second) continue;
      is_free[j] = false;
      places[j] = next;
      open.push(j);
    }
  }
  return grid;
}

}  // namespace

int edge_along(const SaddleCorner& corner, const Vector2d& direction, double min_cosine) {
  const double limit = min_cosine * direction.norm();
  int nearest = -1;
  double max_cosine = limit;
  for (int k = 0; k < 4; ++k) {
    const double cosine = corner.edges[static_cast<std::size_t>(k)].dot(direction);
    if (!(cosine > max_cosine)) continue;
    max_cosine = cosine;
    nearest = k;
  }
  return nearest;
}

std::vector<LinkedGrid> linked_grids(const GreyLevel& level,
                                     const std::vector<SaddleCorner>& corners,
                                     std::size_t min_corners) {
  std::vector<LinkedGrid> grids;
  if (corners.size() < min_corners) return grids;
  const CornerLinks links = nearest_along_edges(level, corners);
  std::vector<bool> is_free(corners.size(), true);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    if (!is_free[i]) continue;
    LinkedGrid grid = grid_from(i, links, is_free);
    if (grid.size() >= min_corners) grids.push_back(std::move(grid));
  }
  std::stable_sort(grids.begin(), grids.end(),
                   [](const LinkedGrid& a, const LinkedGrid& b) { return a.size() > b.size(); });
  return grids;
}

}  // namespace occ::internal::landmarks
