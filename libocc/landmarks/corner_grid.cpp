// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/corner_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/landmarks/internal/corner_links.hpp"

namespace occ::internal::landmarks {
namespace {

using Eigen::Vector2d;

/// Corners of a board of which some are missing, row by row.
class PartialBoard {
 public:
  PartialBoard(const GreyLevel& level, int columns, int rows)
      : level_(level),
        columns_(columns),
        rows_(rows),
        cells_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

  void set(int column, int row, const SaddleCorner& corner) { cell(column, row) = corner; }

  /// Searches the missing corners where the others predict them, from inside to outside. A few
  /// that are hidden, as in glare, keep the predicted position. False if others are not found.
  bool complete() {
    while (true) {
      std::vector<std::pair<std::size_t, SaddleCorner>> found;
      std::size_t missing = 0;
      for (int row = 0; row < rows_; ++row)
        for (int column = 0; column < columns_; ++column) {
          if (cell(column, row)) continue;
          ++missing;
          if (const auto corner = search(column, row))
            found.emplace_back(static_cast<std::size_t>(row * columns_ + column), *corner);
        }
      if (missing == 0) return true;
      if (found.empty()) return interpolate(missing);
      for (const auto& [index, corner] : found) cells_[index] = corner;
    }
  }

  CornerGrid grid() const {
    CornerGrid all{columns_, rows_, {}};
    for (const auto& corner : cells_) all.corners.push_back(*corner);
    return all;
  }

 private:
  std::optional<SaddleCorner>& cell(int column, int row) {
    return cells_[static_cast<std::size_t>(row * columns_ + column)];
  }
  const SaddleCorner* known(int column, int row) {
    if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return nullptr;
    const auto& corner = cell(column, row);
    return corner ? &*corner : nullptr;
  }

  /// Position that the neighbours predict, and the distance to the nearest of them.
  struct Prediction {
    Vector2d sum = Vector2d::Zero();
    double weight = 0, spacing_px = std::numeric_limits<double>::infinity();

    void add(double w, const Vector2d& px) {
      sum += w * px;
      weight += w;
    }
    Vector2d px() const { return sum / weight; }
  };

  Prediction predict(int column, int row) {
    // Weights are about the inverse variances of the perspective that each formula neglects.
    constexpr double inside = 4, parallelogram = 2, outside = 1;
    constexpr int du[] = {1, 0, -1, 0}, dv[] = {0, 1, 0, -1};
    Prediction found;
    for (int k = 0; k < 4; ++k) {
      const SaddleCorner* one = known(column + du[k], row + dv[k]);
      if (one == nullptr) continue;
      const SaddleCorner* two = known(column + 2 * du[k], row + 2 * dv[k]);
      const SaddleCorner* opposite = known(column - du[k], row - dv[k]);
      if (opposite != nullptr) found.add(0.5 * inside, 0.5 * (one->px + opposite->px));
      if (opposite == nullptr && two != nullptr) found.add(outside, 2 * one->px - two->px);
      for (const int other : {(k + 1) % 4, (k + 3) % 4}) {
        const SaddleCorner* side = known(column + du[other], row + dv[other]);
        const SaddleCorner* diagonal = known(column + du[k] + du[other], row + dv[k] + dv[other]);
        if (side != nullptr && diagonal != nullptr)
          found.add(0.5 * parallelogram, one->px + side->px - diagonal->px);
      }
      for (const SaddleCorner* next : {two, known(column + du[k] + dv[k], row + dv[k] + du[k])})
        if (next != nullptr)
          found.spacing_px = std::min(found.spacing_px, (next->px - one->px).norm());
    }
    return found;
  }

  /// Sets the last missing corners to the positions between their neighbours. False if they are too
  /// many, or if one is not between two others.
  bool interpolate(std::size_t missing) {
    constexpr double max_part = 0.1, spacing_sigma = 0.1;
    if (static_cast<double>(missing) > max_part * static_cast<double>(cells_.size())) return false;
    std::vector<std::pair<std::size_t, SaddleCorner>> found;
    for (int row = 0; row < rows_; ++row)
      for (int column = 0; column < columns_; ++column) {
        if (cell(column, row)) continue;
        const SaddleCorner *left = known(column - 1, row), *right = known(column + 1, row);
        const SaddleCorner *above = known(column, row - 1), *below = known(column, row + 1);
        const bool across = left != nullptr && right != nullptr;
        if (!across && (above == nullptr || below == nullptr)) return false;
        const Prediction prediction = predict(column, row);
        SaddleCorner corner = across ? *left : *above;
        // The colours alternate from corner to corner.
        std::rotate(corner.edges.begin(), corner.edges.begin() + 1, corner.edges.end());
        corner.px = prediction.px();
        corner.sigma_px = std::max(corner.sigma_px, spacing_sigma * prediction.spacing_px);
        found.emplace_back(static_cast<std::size_t>(row * columns_ + column), corner);
      }
    for (const auto& [index, corner] : found) cells_[index] = corner;
    return true;
  }

  std::optional<SaddleCorner> search(int column, int row) {
    constexpr double radius_part = 0.35, max_radius_px = 5, min_radius_px = 2;
    constexpr double max_shift = 0.2;  // of the spacing: perspective that the formulas neglect
    // A predicted corner needs less evidence than a free one, for example in glare.
    // At the border of the board, where a black square meets white paper, the part is 1.
    constexpr double max_odd_part = 0.6;
    constexpr double start_px = 2;  // corner_near() searches within 2 px
    const Prediction prediction = predict(column, row);
    if (!(prediction.weight > 0) || !std::isfinite(prediction.spacing_px)) return std::nullopt;
    const double spacing = prediction.spacing_px;
    const CircleLimits limits{std::clamp(radius_part * spacing, min_radius_px, max_radius_px),
                              max_odd_part};
    std::optional<SaddleCorner> nearest;
    const int steps = static_cast<int>(max_shift * spacing / start_px);
    for (int y = -steps; y <= steps; ++y)
      for (int x = -steps; x <= steps; ++x) {
        const auto corner =
            corner_near(level_, prediction.px() + start_px * Vector2d(x, y), limits);
        if (!corner || !((corner->px - prediction.px()).norm() < max_shift * spacing + 1) ||
            !has_colours(column, row, *corner))
          continue;
        if (!nearest ||
            (corner->px - prediction.px()).norm() < (nearest->px - prediction.px()).norm())
          nearest = corner;
      }
    return nearest;
  }

  /// True if the contrast is comparable to that of known neighbours, and if the edges towards them
  /// have the colours that these require.
  bool has_colours(int column, int row, const SaddleCorner& corner) {
    constexpr double min_cosine = 0.85;    // 32 degrees
    constexpr double min_contrast = 0.15;  // in glare; noise on white paper has less
    constexpr int du[] = {1, 0, -1, 0}, dv[] = {0, 1, 0, -1};
    for (int k = 0; k < 4; ++k) {
      const SaddleCorner* next = known(column + du[k], row + dv[k]);
      if (next == nullptr) continue;
      if (!(corner.contrast > min_contrast * next->contrast)) return false;
      const int here = edge_along(corner, next->px - corner.px, min_cosine);
      const int there = edge_along(*next, corner.px - next->px, min_cosine);
      if (here < 0 || there < 0 || (here - there) % 2 == 0) return false;
    }
    return true;
  }

  const GreyLevel& level_;
  int columns_, rows_;
  std::vector<std::optional<SaddleCorner>> cells_;
};

/// A place of the board in a grid of linked corners.
struct BoardPlace {
  int u = 0, v = 0;         // first corner
  bool transposed = false;  // the board's columns run along v
  std::size_t count = 0;    // number of corners that are found
};

/// Extent of a linked grid.
struct GridExtent {
  int u0 = 0, u1 = 0, v0 = 0, v1 = 0;

  explicit GridExtent(const LinkedGrid& grid) {
    u0 = u1 = grid.begin()->first.first;
    v0 = v1 = grid.begin()->first.second;
    for (const auto& [at, index] : grid) {
      u0 = std::min(u0, at.first);
      u1 = std::max(u1, at.first);
      v0 = std::min(v0, at.second);
      v1 = std::max(v1, at.second);
    }
  }
};

/// All places where most corners of the board are found, the best first.
std::vector<BoardPlace> places_of(const LinkedGrid& grid, int columns, int rows,
                                  std::size_t min_corners) {
  constexpr int max_outside = 2;  // rows or columns of the board that are missing on one side
  const GridExtent extent(grid);
  std::vector<BoardPlace> places;
  for (const bool transposed : {false, true}) {
    if (transposed && columns == rows) continue;
    const int wide = transposed ? rows : columns, high = transposed ? columns : rows;
    for (int v = extent.v0 - max_outside; v + high <= extent.v1 + 1 + max_outside; ++v)
      for (int u = extent.u0 - max_outside; u + wide <= extent.u1 + 1 + max_outside; ++u) {
        BoardPlace place{u, v, transposed, 0};
        for (auto at = grid.lower_bound({u, v}); at != grid.end() && at->first.first < u + wide;
             ++at)
          if (at->first.second >= v && at->first.second < v + high) ++place.count;
        if (place.count >= min_corners) places.push_back(place);
      }
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const BoardPlace& a, const BoardPlace& b) { return a.count > b.count; });
  return places;
}

/// True if the steps of a row of corners change smoothly: third differences are below a fifth of
/// the shortest step. Perspective of a board that is tilted by 60 degrees and fills a wide-angle
/// image gives a tenth.
bool is_smooth(const std::vector<Vector2d>& row) {
  constexpr double max_part = 0.2;
  for (std::size_t i = 3; i < row.size(); ++i) {
    double step = std::numeric_limits<double>::infinity();
    for (std::size_t k = i - 2; k <= i; ++k) step = std::min(step, (row[k] - row[k - 1]).norm());
    const Vector2d third = row[i] - 3 * row[i - 1] + 3 * row[i - 2] - row[i - 3];
    if (!(third.norm() < max_part * step + 1)) return false;  // 1 px: errors of the corners
  }
  return true;
}

bool is_smooth(const CornerGrid& grid) {
  for (int row = 0; row < grid.rows; ++row) {
    std::vector<Vector2d> px;
    for (int column = 0; column < grid.columns; ++column) px.push_back(grid.at(column, row).px);
    if (!is_smooth(px)) return false;
  }
  for (int column = 0; column < grid.columns; ++column) {
    std::vector<Vector2d> px;
    for (int row = 0; row < grid.rows; ++row) px.push_back(grid.at(column, row).px);
    if (!is_smooth(px)) return false;
  }
  return true;
}

std::optional<CornerGrid> complete_at(const BoardPlace& place, const LinkedGrid& grid,
                                      const GreyLevel& level,
                                      const std::vector<SaddleCorner>& corners, int columns,
                                      int rows) {
  PartialBoard board(level, columns, rows);
  for (const auto& [at, index] : grid) {
    const int u = at.first - place.u, v = at.second - place.v;
    const int column = place.transposed ? v : u, row = place.transposed ? rows - 1 - u : v;
    if (column >= 0 && row >= 0 && column < columns && row < rows)
      board.set(column, row, corners[index]);
  }
  if (!board.complete()) return std::nullopt;
  CornerGrid complete = board.grid();
  if (!is_smooth(complete)) return std::nullopt;
  return complete;
}

CornerGrid quarter_turned(const CornerGrid& grid) {
  CornerGrid turned{grid.rows, grid.columns, {}};
  for (int row = 0; row < turned.rows; ++row)
    for (int column = 0; column < turned.columns; ++column)
      turned.corners.push_back(grid.at(grid.columns - 1 - row, column));
  return turned;
}

bool first_square_is_black(const CornerGrid& grid) {
  const int edge = edge_along(grid.at(0, 0), grid.at(1, 0).px - grid.at(0, 0).px, 0.5);
  return edge % 2 == 1;  // the sector behind the edge is dark, and so is the opposite one
}

CornerGrid oriented(const CornerGrid& found) {
  std::optional<CornerGrid> best;
  bool best_black = false;
  double best_right = 0;
  CornerGrid turned = found;
  for (int turn = 0; turn < 4; ++turn, turned = quarter_turned(turned)) {
    if (turned.columns != found.columns || turned.rows != found.rows) continue;
    const bool black = first_square_is_black(turned);
    const double right = (turned.at(turned.columns - 1, 0).px - turned.at(0, 0).px).x() +
                         (turned.at(0, turned.rows - 1).px - turned.at(0, 0).px).y();
    if (best && (black < best_black || (black == best_black && !(right > best_right)))) continue;
    best = turned;
    best_black = black;
    best_right = right;
  }
  return *best;
}

}  // namespace

std::optional<CornerGrid> find_grid(const GreyLevel& level,
                                    const std::vector<SaddleCorner>& corners, int columns,
                                    int rows) {
  constexpr double min_part = 0.6;  // of the corners; the others are searched
  constexpr std::size_t extra_corners = 4;
  constexpr std::size_t max_tries = 12;  // places with equally many corners
  const auto count = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
  const auto min_corners =
      static_cast<std::size_t>(std::ceil(min_part * static_cast<double>(count)));
  for (const LinkedGrid& grid : linked_grids(level, corners, min_corners)) {
    // Corners beside the board may continue its grid; more of them are a larger board.
    if (grid.size() > std::max(count + extra_corners, count + count / 8)) continue;
    const std::vector<BoardPlace> places = places_of(grid, columns, rows, min_corners);
    std::optional<CornerGrid> found;
    bool is_unique = true;
    for (std::size_t i = 0; i < places.size() && i < max_tries && is_unique; ++i) {
      if (found && places[i].count < places[0].count) break;
      auto board = complete_at(places[i], grid, level, corners, columns, rows);
      if (!board) continue;
      is_unique = !found;
      found = std::move(board);
    }
    if (found && is_unique) return oriented(*found);
  }
  return std::nullopt;
}

}  // namespace occ::internal::landmarks
