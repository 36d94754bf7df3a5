// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/chessboard.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/require.hpp"
#include "libocc/landmarks/internal/corner_fit.hpp"
#include "libocc/landmarks/internal/corner_grid.hpp"
#include "libocc/landmarks/internal/edge_bend.hpp"
#include "libocc/landmarks/internal/grey_image.hpp"
#include "libocc/landmarks/internal/grid_scatter.hpp"
#include "libocc/landmarks/internal/saddles.hpp"

namespace occ {

using namespace internal::landmarks;
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// Factors by which the image is reduced, in the order of the searches: a small image first, which
/// suffices for most boards, then a smaller one for blurred boards, then larger ones for small
/// squares, and at last the smallest.
std::vector<int> search_factors(const Image& image) {
  constexpr double first_px = 900;  // squares of 1/90 of the longer side have 10 px
  const int side = std::max(image.width, image.height);
  const int first = std::max(1, static_cast<int>(std::lround(side / first_px)));
  std::vector<int> factors{first, 2 * first};
  for (int factor = first / 2; factor >= 1; factor /= 2) factors.push_back(factor);
  factors.push_back(4 * first);
  return factors;
}

/// A board found in a reduced image.
struct FoundBoard {
  CornerGrid grid;
  int factor = 1;
};

std::optional<FoundBoard> search_board(const Image& pixels, unsigned white,
                                       const ChessboardOptions& options) {
  const std::vector<int> factors = search_factors(pixels);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (options.progress &&
        !options.progress(static_cast<int>(i), static_cast<int>(factors.size())))
      return std::nullopt;
    const GreyLevel level(pixels, white, factors[i]);
    auto grid = find_grid(level, find_corners(level), options.columns, options.rows);
    if (!grid) continue;
    for (SaddleCorner& corner : grid->corners) corner.px = level.full_px(corner.px);
    return FoundBoard{std::move(*grid), factors[i]};
  }
  return std::nullopt;
}

/// Distance of a corner from the nearest line of the board that does not pass through it.
double clearance_px(const CornerGrid& grid, int column, int row) {
  const Vector2d& here = grid.at(column, row).px;
  double clearance = std::numeric_limits<double>::infinity();
  for (const int i : {-1, 1})
    for (const int j : {-1, 1}) {
      if (column + i < 0 || column + i >= grid.columns || row + j < 0 || row + j >= grid.rows)
        continue;
      const Vector2d across = grid.at(column + i, row).px - here;
      const Vector2d down = grid.at(column, row + j).px - here;
      const double area = std::abs(across.x() * down.y() - across.y() * down.x());
      clearance = std::min({clearance, area / across.norm(), area / down.norm()});
    }
  return clearance;
}

constexpr double part_of_clearance = 0.5;  // the rest is for the blur of the neighbouring edges

CornerStart start_of(const FoundBoard& board, int column, int row, double white,
                     double max_window_px) {
  constexpr double min_radius_px = 3;  // twice as many pixels as unknowns
  const SaddleCorner& corner = board.grid.at(column, row);
  CornerStart start;
  start.px = corner.px;
  start.edges[0] = corner.edges[0];
  start.edges[1] = corner.edges[1];
  start.contrast = corner.contrast * white / 255;
  start.blur_px = std::max(1.0, 0.5 * board.factor);
  start.radius_px = std::clamp(part_of_clearance * clearance_px(board.grid, column, row),
                               min_radius_px, std::max(min_radius_px, max_window_px));
  return start;
}

/// Column and row of each corner.
Eigen::Matrix2Xd grid_positions(const ChessboardOptions& options) {
  Eigen::Matrix2Xd at(2, options.columns * options.rows);
  for (int row = 0; row < options.rows; ++row)
    for (int column = 0; column < options.columns; ++column)
      at.col(row * options.columns + column) = Vector2d(column, row);
  return at;
}

/// Fits a corner; the window grows with the blur, up to a radius of max_px.
bool fit_with_window(const GreyImage& grey, CornerStart& start, double max_px, CornerFit& fit) {
  constexpr double min_radius = 3;  // blurs: the levels beyond both edges are part of the model
  constexpr double growth = 2;
  constexpr int max_windows = 4;
  for (int i = 0; i < max_windows; ++i) {
    const bool fits = fit_corner(grey, start, fit);
    if ((fits && start.radius_px >= min_radius * fit.blur_px) || start.radius_px >= max_px)
      return fits;
    start.radius_px = std::min(growth * start.radius_px, max_px);
    start.blur_px *= growth;
  }
  return false;
}

/// Fits corners again with the bends of the rows and columns through them. Near a wide lens,
/// straight edges would move the corners towards the middle of the image. `fitted`: indices of the
/// fits.
void fit_bent(const GreyImage& grey, const ChessboardOptions& options,
              const std::vector<std::size_t>& fitted, const Eigen::Matrix2Xd& px,
              const std::vector<CornerStart>& starts, std::vector<CornerFit>& fits) {
  constexpr double max_shift_px = 0.3;  // a larger one is a change to another minimum
  constexpr double min_sag_px = 2e-3;   // at the edge of the window; moves the corner by less
  constexpr int reach = static_cast<int>(max_bend_points) / 2;
  std::vector<bool> is_fitted(static_cast<std::size_t>(px.cols()), false);
  for (const std::size_t k : fitted) is_fitted[k] = true;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const int column = static_cast<int>(fitted[i]) % options.columns;
    const int row = static_cast<int>(fitted[i]) / options.columns;
    const Vector2d here = px.col(static_cast<Eigen::Index>(fitted[i]));
    CornerStart start = starts[i];
    continue_from(fits[i], start);
    for (const int axis : {0, 1}) {
      const int at = axis == 0 ? column : row, count = axis == 0 ? options.columns : options.rows;
      const int first = std::clamp(at - reach, 0, std::max(0, count - 1 - 2 * reach));
      std::vector<Vector2d> others;
      Vector2d along = Vector2d::Zero();
      for (int k = first; k <= std::min(first + 2 * reach, count - 1); ++k) {
        const int index = axis == 0 ? row * options.columns + k : k * options.columns + column;
        if (k == at || !is_fitted[static_cast<std::size_t>(index)]) continue;
        others.emplace_back(px.col(index));
        along = others.back() - here;
      }
      if (others.empty()) continue;
      const bool is_first =
          std::abs(start.edges[0].dot(along)) > std::abs(start.edges[1].dot(along));
      start.bends_per_px[is_first ? 0 : 1] = edge_bend(here, others);
    }
    const double bend_per_px = std::max(start.bends_per_px[0].norm(), start.bends_per_px[1].norm());
    if (0.5 * start.radius_px * start.radius_px * bend_per_px < min_sag_px) continue;
    CornerFit fit;
    if (fit_corner(grey, start, fit) && (fit.px - here).norm() < max_shift_px)
      fits[i] = std::move(fit);
  }
}

/// Fits all corners; those without a fit keep their position in the reduced image.
ChessboardCorners measure_corners(const Image& pixels, unsigned white, const FoundBoard& board,
                                  const ChessboardOptions& options) {
  const GreyImage grey(pixels);
  ChessboardCorners corners;
  corners.px.resize(2, options.columns * options.rows);
  for (const SaddleCorner& corner : board.grid.corners) {
    const double coarse_px = corner.sigma_px * board.factor;
    corners.covariance_px2.push_back(coarse_px * coarse_px * Matrix2d::Identity());
  }
  std::vector<CornerFit> fits;
  std::vector<CornerStart> starts;
  std::vector<std::size_t> fitted;
  for (int row = 0; row < options.rows; ++row)
    for (int column = 0; column < options.columns; ++column) {
      const Eigen::Index k = row * options.columns + column;
      corners.px.col(k) = board.grid.at(column, row).px;
      CornerFit fit;
      CornerStart start = start_of(board, column, row, white, options.max_window_px);
      if (!fit_with_window(grey, start, part_of_clearance * clearance_px(board.grid, column, row),
                           fit))
        continue;
      corners.px.col(k) = fit.px;
      starts.push_back(start);
      fitted.push_back(static_cast<std::size_t>(k));
      fits.push_back(std::move(fit));
    }
  fit_bent(grey, options, fitted, corners.px, starts, fits);
  for (std::size_t i = 0; i < fits.size(); ++i)
    corners.px.col(static_cast<Eigen::Index>(fitted[i])) = fits[i].px;
  const std::vector<Matrix2d> covariances = noise_covariances(fits);
  for (std::size_t i = 0; i < fits.size(); ++i) corners.covariance_px2[fitted[i]] = covariances[i];
  corners.unfitted = static_cast<int>(board.grid.corners.size() - fits.size());
  return corners;
}

}  // namespace

void ChessboardOptions::validate() const {
  require(columns >= 3 && columns <= 200, "columns", columns, "between 3 and 200");
  require(rows >= 3 && rows <= 200, "rows", rows, "between 3 and 200");
  require(max_window_px >= 2 && max_window_px <= 100, "max_window_px", max_window_px,
          "between 2 and 100");
  require(model_sigma_px >= 0 && std::isfinite(model_sigma_px), "model_sigma_px", model_sigma_px,
          "zero or positive");
}

std::optional<ChessboardCorners> find_chessboard(const ImageView& image,
                                                 const ChessboardOptions& options) {
  options.validate();
  image.validate();
  const Image pixels = to_grey(image);
  const unsigned white = white_level(pixels);
  const std::optional<FoundBoard> board = search_board(pixels, white, options);
  if (!board) return std::nullopt;
  ChessboardCorners corners = measure_corners(pixels, white, *board, options);
  // A grid of corners that are not corners of squares is a pattern in noise.
  constexpr double max_unfitted = 1 / 3.0;  // part; the rest may be in glare
  if (corners.unfitted > max_unfitted * static_cast<double>(corners.px.cols())) return std::nullopt;
  const double scatter_px2 = grid_scatter_px2(grid_positions(options), corners.px,
                                              corners.covariance_px2, image_middle(pixels));
  corners.scatter_sigma_px = std::sqrt(scatter_px2);
  const double added_px2 = options.model_sigma_px * options.model_sigma_px + scatter_px2;
  for (Matrix2d& covariance : corners.covariance_px2)
    covariance += added_px2 * Matrix2d::Identity();
  return corners;
}

}  // namespace occ
