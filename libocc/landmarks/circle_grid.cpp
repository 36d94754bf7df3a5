// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/circle_grid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/landmarks/internal/circle_blobs.hpp"
#include "libocc/landmarks/internal/circle_outline.hpp"
#include "libocc/landmarks/internal/grey_image.hpp"
#include "libocc/landmarks/internal/grid_scatter.hpp"

namespace occ {

using namespace internal::landmarks;
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using LatticePoint = std::pair<int, int>;

/// Positions of the discs in a square lattice, in their order. The lattice of an asymmetric grid is
/// spanned by the diagonals.
std::vector<LatticePoint> lattice_pattern(const CircleGridOptions& options) {
  std::vector<LatticePoint> pattern;
  for (int row = 0; row < options.rows; ++row)
    for (int column = 0; column < options.columns; ++column) {
      const int x = options.asymmetric ? 2 * column + row % 2 : column;
      pattern.emplace_back(options.asymmetric ? (x + row) / 2 : x,
                           options.asymmetric ? (row - x) / 2 : row);
    }
  return pattern;
}

/// Blobs of the discs in their order, and the images of the first row and the first column.
struct PlacedGrid {
  std::vector<std::size_t> blobs;
  double right_px = 0;  // extent of the rows to the right and of the columns downwards
};

/// All places of the grid in a lattice. Places of the same blobs differ by a symmetry.
std::vector<PlacedGrid> placed_grids(const BlobLattice& lattice,
                                     const std::vector<EllipseBlob>& blobs,
                                     const CircleGridOptions& options) {
  std::vector<PlacedGrid> places;
  std::vector<LatticePoint> pattern = lattice_pattern(options);
  const auto columns = static_cast<std::size_t>(options.columns);
  for (int turn = 0; turn < 4; ++turn) {
    for (const auto& [first, index] : lattice) {
      PlacedGrid place;
      for (const LatticePoint& at : pattern) {
        const auto found = lattice.find({first.first + at.first - pattern[0].first,
                                         first.second + at.second - pattern[0].second});
        if (found == lattice.end()) break;
        place.blobs.push_back(found->second);
      }
      if (place.blobs.size() < pattern.size()) continue;
      const Vector2d& origin = blobs[place.blobs.front()].px;
      place.right_px = (blobs[place.blobs[columns - 1]].px - origin).x() +
                       (blobs[place.blobs[place.blobs.size() - columns]].px - origin).y();
      places.push_back(std::move(place));
    }
    for (LatticePoint& at : pattern) at = {-at.second, at.first};
  }
  return places;
}

/// The only place of the grid, in its upright orientation. Empty if there is none or if there are
/// several, which means that the real grid is larger.
std::vector<std::size_t> unique_grid(const BlobLattice& lattice,
                                     const std::vector<EllipseBlob>& blobs,
                                     const CircleGridOptions& options) {
  const auto sorted = [](std::vector<std::size_t> values) {
    std::sort(values.begin(), values.end());
    return values;
  };
  // Blobs beside the board may continue its lattice; more of them are discs of a larger grid.
  constexpr double max_part = 1.1;
  const auto count = static_cast<double>(options.columns) * options.rows;
  if (static_cast<double>(lattice.size()) > std::max(max_part * count, count + 2)) return {};
  const PlacedGrid* best = nullptr;
  const std::vector<PlacedGrid> places = placed_grids(lattice, blobs, options);
  for (const PlacedGrid& place : places) {
    if (best != nullptr && sorted(place.blobs) != sorted(best->blobs)) return {};
    if (best == nullptr || place.right_px > best->right_px) best = &place;
  }
  return best != nullptr ? best->blobs : std::vector<std::size_t>{};
}

/// Discs found in a reduced image, in the order of the grid and in pixels of the full image.
struct FoundDiscs {
  std::vector<EllipseBlob> blobs;
  bool dark = true;
  int factor = 1;
};

std::optional<FoundDiscs> find_discs(const GreyLevel& level, const CircleGridOptions& options) {
  const auto count =
      static_cast<std::size_t>(options.columns) * static_cast<std::size_t>(options.rows);
  for (const bool dark : {true, false}) {
    const std::vector<EllipseBlob> blobs = find_ellipses(level, dark);
    std::vector<std::size_t> grid;
    for_each_lattice(blobs, count, [&](const BlobLattice& lattice) {
      grid = unique_grid(lattice, blobs, options);
      return !grid.empty();
    });
    if (grid.empty()) continue;
    FoundDiscs found;
    found.dark = dark;
    found.factor = level.factor();
    for (const std::size_t i : grid) {
      found.blobs.push_back(blobs[i]);
      found.blobs.back().px = level.full_px(blobs[i].px);
      found.blobs.back().moments *= square(level.factor());
    }
    return found;
  }
  return std::nullopt;
}

/// Factors by which the image is reduced. Discs of a board that fills the image have 20 to 30 px in
/// the first one. Larger images than max_px would take seconds to search in noise, for discs of
/// less than 1/500 of the image.
std::vector<int> disc_factors(const Image& image) {
  constexpr double first_px = 600, max_px = 2400;
  const int side = std::max(image.width, image.height);
  const int first = std::max(1, static_cast<int>(std::lround(side / first_px)));
  std::vector<int> factors{first};
  for (int factor = first / 2; factor >= 1 && side / factor <= max_px; factor /= 2)
    factors.push_back(factor);
  factors.push_back(2 * first);
  factors.push_back(4 * first);
  return factors;
}

std::optional<FoundDiscs> search_discs(const Image& pixels, const CircleGridOptions& options) {
  const unsigned white = white_level(pixels);
  const std::vector<int> factors = disc_factors(pixels);
  for (std::size_t i = 0; i < factors.size(); ++i) {
    if (options.progress &&
        !options.progress(static_cast<int>(i), static_cast<int>(factors.size())))
      return std::nullopt;
    if (auto found = find_discs(GreyLevel(pixels, white, factors[i]), options)) return found;
  }
  return std::nullopt;
}

/// S of the ellipse with these moments: twice their square root (Levinger, "The square root of a 2
/// x 2 matrix", Mathematics Magazine 53, 1980).
Matrix2d ellipse_shape(const Matrix2d& moments) {
  const double root = std::sqrt(moments.determinant());
  return 2 / std::sqrt(moments.trace() + 2 * root) * (moments + root * Matrix2d::Identity());
}

/// Half the gap between a disc and the nearest other one.
double half_gap_px(const std::vector<EllipseBlob>& blobs, std::size_t i) {
  const auto half_axis = [](const EllipseBlob& blob, const Vector2d& direction) {
    return 2 * std::sqrt(direction.dot(blob.moments * direction));
  };
  double gap = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < blobs.size(); ++j) {
    if (j == i) continue;
    const Vector2d between = blobs[j].px - blobs[i].px;
    const Vector2d direction = between.normalized();
    gap = std::min(
        gap, between.norm() - half_axis(blobs[i], direction) - half_axis(blobs[j], direction));
  }
  return 0.5 * gap;
}

/// Fits all outlines; discs without a fit keep their centroid in the reduced image.
CircleGridPoints measure_discs(const Image& pixels, const FoundDiscs& found) {
  constexpr double max_reach_px = 6;         // several times the blur of a sharp image
  constexpr double centroid_sigma_px = 0.3;  // of the reduced image
  const GreyImage grey(pixels);
  CircleGridPoints points;
  points.dark = found.dark;
  points.px.resize(2, static_cast<Eigen::Index>(found.blobs.size()));
  const double coarse_px = centroid_sigma_px * found.factor;
  points.covariance_px2.assign(found.blobs.size(), coarse_px * coarse_px * Matrix2d::Identity());
  std::vector<EllipseOutline> outlines;
  std::vector<std::size_t> fitted;
  for (std::size_t i = 0; i < found.blobs.size(); ++i) {
    EllipseOutline outline;
    outline.centre_px = found.blobs[i].px;
    outline.shape = ellipse_shape(found.blobs[i].moments);
    points.px.col(static_cast<Eigen::Index>(i)) = outline.centre_px;
    if (!fit_outline(grey, std::min(max_reach_px, half_gap_px(found.blobs, i)), outline)) continue;
    points.px.col(static_cast<Eigen::Index>(i)) = outline.centre_px;
    fitted.push_back(i);
    outlines.push_back(std::move(outline));
  }
  const std::vector<Matrix2d> covariances = centre_covariances(outlines);
  for (std::size_t i = 0; i < fitted.size(); ++i) points.covariance_px2[fitted[i]] = covariances[i];
  points.unfitted = static_cast<int>(found.blobs.size() - fitted.size());
  return points;
}

}  // namespace

void CircleGridOptions::validate() const {
  require(columns >= 2 && columns <= 200, "columns", columns, "between 2 and 200");
  require(rows >= 3 && rows <= 200, "rows", rows, "between 3 and 200");
  require(model_sigma_px >= 0 && std::isfinite(model_sigma_px), "model_sigma_px", model_sigma_px,
          "zero or positive");
}

Eigen::Matrix2Xd circle_grid_positions(int columns, int rows, bool asymmetric, double spacing) {
  require(columns >= 1, "columns", columns, "at least 1");
  require(rows >= 1, "rows", rows, "at least 1");
  require(spacing > 0 && std::isfinite(spacing), "spacing", spacing, "positive");
  Eigen::Matrix2Xd at(2, columns * rows);
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      at.col(row * columns + column) =
          spacing * Vector2d(asymmetric ? 2 * column + row % 2 : column, row);
  return at;
}

std::optional<CircleGridPoints> find_circle_grid(const ImageView& image,
                                                 const CircleGridOptions& options) {
  options.validate();
  image.validate();
  const Image pixels = to_grey(image);
  const std::optional<FoundDiscs> found = search_discs(pixels, options);
  if (!found) return std::nullopt;
  CircleGridPoints points = measure_discs(pixels, *found);
  constexpr double max_unfitted = 1 / 3.0;  // part; the rest may be in glare
  if (points.unfitted > max_unfitted * static_cast<double>(points.px.cols())) return std::nullopt;
  const double scatter_px2 =
      grid_scatter_px2(circle_grid_positions(options.columns, options.rows, options.asymmetric, 1),
                       points.px, points.covariance_px2, image_middle(pixels));
  points.scatter_sigma_px = std::sqrt(scatter_px2);
  const double added_px2 = square(options.model_sigma_px) + scatter_px2;
  for (Matrix2d& covariance : points.covariance_px2) covariance += added_px2 * Matrix2d::Identity();
  return points;
}

}  // namespace occ
