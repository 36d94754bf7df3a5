// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/chessboard.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/landmarks/internal/chessboard_search.hpp"
#include "libocc/landmarks/internal/grey_image.hpp"

namespace occ {

using namespace internal::landmarks;
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// Standard deviation of a pixel's noise, from the median absolute difference between a pixel and
/// the mean of its four neighbours. Edges of the board hardly affect the median.
double noise_of(const GreyImage& grey) {
  constexpr double median_of_normal = 0.6745;       // median absolute value for unit sigma
  const double of_cross = std::sqrt(1 + 4 / 16.0);  // sigma of the difference for unit sigma
  const int step = 1 + std::min(grey.width(), grey.height()) / 200;
  std::vector<double> off;
  for (int y = 1; y < grey.height() - 1; y += step)
    for (int x = 1; x < grey.width() - 1; x += step)
      off.push_back(
          std::abs(grey.pixel(x, y) - 0.25 * (grey.pixel(x - 1, y) + grey.pixel(x + 1, y) +
                                              grey.pixel(x, y - 1) + grey.pixel(x, y + 1))));
  const double rounding = 1 / std::sqrt(12.0);
  return std::hypot(median(off) / (median_of_normal * of_cross), rounding);
}

struct Corner {
  Vector2d px;
  Matrix2d covariance;
};

/// Sums over a window of 2 half + 1 samples per side around a corner.
struct Window {
  Matrix2d a = Matrix2d::Zero();  // sum of w g g^T
  Vector2d b = Vector2d::Zero();  // sum of w g g^T d
  std::vector<Matrix2d> by_g;     // d b / d g of each sample, row by row
};

bool sum_window(const GreyImage& grey, int half, const Vector2d& px, Window& window) {
  if (!grey.holds(px, half + 2)) return false;
  window = {};
  for (int j = -half; j <= half; ++j)
    for (int i = -half; i <= half; ++i) {
      const Vector2d d(i, j), p = px + d;
      const Vector2d g(0.5 * (grey.at(p + Vector2d::UnitX()) - grey.at(p - Vector2d::UnitX())),
                       0.5 * (grey.at(p + Vector2d::UnitY()) - grey.at(p - Vector2d::UnitY())));
      const double w = std::exp(-d.squaredNorm() / (half * half));
      window.a += w * g * g.transpose();
      window.b += w * g * g.dot(d);
      window.by_g.push_back(w * (g.dot(d) * Matrix2d::Identity() + g * d.transpose()));
    }
  constexpr double min_condition = 1e-3;
  const Vector2d eigenvalues = internal::core::symmetric_eigenvalues(window.a);
  return eigenvalues[0] > min_condition * eigenvalues[1];
}

/// Covariance of the sum b for pixel noise of unit variance; gradients are differences of
/// bilinearly interpolated pixels.
Matrix2d noise_of_sum(const Window& window, int half, const Vector2d& px) {
  const int side = 2 * half + 1, padded = side + 4;  // window with its neighbouring pixels
  std::vector<Vector2d> by_pixel(static_cast<std::size_t>(padded * padded), Vector2d::Zero());
  const Vector2d base(std::floor(px.x()), std::floor(px.y())), part = px - base;
  const auto add = [&](int x, int y, const Vector2d& by_sample) {
    for (int v = 0; v < 2; ++v)
      for (int u = 0; u < 2; ++u) {
        const double weight =
            (u == 1 ? part.x() : 1 - part.x()) * (v == 1 ? part.y() : 1 - part.y());
        by_pixel[(y + 1 + v) * padded + x + 1 + u] += weight * by_sample;
      }
  };
  for (int y = 0; y < side; ++y)
    for (int x = 0; x < side; ++x) {
      const Matrix2d& m = window.by_g[y * side + x];
      add(x + 1, y, 0.5 * m.col(0));
      add(x - 1, y, -0.5 * m.col(0));
      add(x, y + 1, 0.5 * m.col(1));
      add(x, y - 1, -0.5 * m.col(1));
    }
  Matrix2d sum = Matrix2d::Zero();
  for (const Vector2d& by : by_pixel) sum += by * by.transpose();
  return sum;
}

bool refine(const GreyImage& grey, int half, double noise, Corner& corner) {
  constexpr int max_steps = 40;
  constexpr double tolerance_px = 1e-4;
  const Vector2d start = corner.px;
  Window window;
  for (int i = 0; i < max_steps; ++i) {
    if (!sum_window(grey, half, corner.px, window)) return false;
    const Vector2d step = window.a.inverse() * window.b;
    if (step.norm() < tolerance_px) break;
    corner.px += step;
    if (!((corner.px - start).norm() < half)) return false;
  }
  const Matrix2d inverse = window.a.inverse();
  corner.covariance = noise * noise * inverse * noise_of_sum(window, half, corner.px) * inverse;
  return true;
}

/// Distance of a corner to the nearest of its neighbours on the board.
double spacing_px(const std::vector<Vector2d>& corners, int columns, int rows, int column,
                  int row) {
  const auto at = [&](int x, int y) { return corners[y * columns + x]; };
  double min_px = std::numeric_limits<double>::infinity();
  const auto look = [&](int x, int y) {
    if (x >= 0 && y >= 0 && x < columns && y < rows)
      min_px = std::min(min_px, (at(x, y) - at(column, row)).norm());
  };
  look(column - 1, row);
  look(column + 1, row);
  look(column, row - 1);
  look(column, row + 1);
  return min_px;
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
  const CoarseCorners coarse_corners = search_board(pixels, options);
  const std::vector<Vector2d>& found = coarse_corners.px;
  if (found.empty()) return std::nullopt;
  const GreyImage grey(pixels);
  const double noise = noise_of(grey);
  constexpr double part_of_square = 0.4;  // half side of the window: within the adjacent squares
  ChessboardCorners corners;
  corners.px.resize(2, options.columns * options.rows);
  for (int row = 0; row < options.rows; ++row)
    for (int column = 0; column < options.columns; ++column) {
      const int k = row * options.columns + column;
      const double side = spacing_px(found, options.columns, options.rows, column, row);
      const int half =
          std::max(2, static_cast<int>(std::min(options.max_window_px, part_of_square * side)));
      const double unrefined_px = 0.3 * coarse_corners.factor;  // sigma of OpenCV's corners
      Corner corner{found[k], unrefined_px * unrefined_px * Matrix2d::Identity()};
      const Corner coarse = corner;
      if (!refine(grey, half, noise, corner)) corner = coarse;
      corners.px.col(k) = corner.px;
      corners.covariance_px2.push_back(corner.covariance + options.model_sigma_px *
                                                               options.model_sigma_px *
                                                               Matrix2d::Identity());
    }
  return corners;
}

}  // namespace occ
