// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/plateau.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace occ::detecting {
namespace {

// Fewer pixels than this leave a surface too free where it is carried on across the rim.
constexpr int least_pixels = 4, plane_pixels = 30, paraboloid_pixels = 200;

constexpr std::size_t terms = 6;
constexpr std::array<std::size_t, terms> u_power = {0, 1, 0, 2, 1, 0};
constexpr std::array<std::size_t, terms> v_power = {0, 0, 1, 0, 1, 2};

/// Sums over pixels of u^i v^j, and of these times the signal.
struct Sums {
  double power[5][5] = {};
  double signal[3][3] = {};
  double squares = 0;
  int pixels = 0;

  /// A row adds what depends on u alone; v is common to it.
  void add_row(const std::array<double, 5>& u, const std::array<double, 3>& s, double v) {
    double factor = 1;
    for (std::size_t j = 0; j < 5; ++j, factor *= v) {
      for (std::size_t i = 0; i + j < 5; ++i) power[i][j] += factor * u[i];
      for (std::size_t i = 0; i + j < 3; ++i) signal[i][j] += factor * s[i];
    }
  }
};

/// Calls f(y, x0, x1) for the rows of pixels inside the ellipse shrunk by a factor.
template <typename F>
void for_each_row(const Patch& patch, const Conic& conic, double shrink, F&& f) {
  const double xx = conic.shape(0, 0), xy = conic.shape(0, 1);
  const double determinant = conic.shape.determinant();
  const double half_height = shrink * std::sqrt(xx / determinant);
  const auto first = [](double v, int low) {
    return std::max(low, static_cast<int>(std::ceil(v)));
  };
  const auto last = [](double v, int high) {
    return std::min(high, static_cast<int>(std::floor(v)));
  };
  const double cx = conic.centre.x(), cy = conic.centre.y();
  const int y1 = last(cy + half_height, patch.y0() + patch.height() - 1);
  for (int y = first(cy - half_height, patch.y0()); y <= y1; ++y) {
    const double dy = y - cy;
    const double root = std::sqrt(std::max(0.0, shrink * shrink * xx - determinant * dy * dy)) / xx;
    const double middle = cx - xy * dy / xx;
    const int x0 = first(middle - root, patch.x0());
    const int x1 = last(middle + root, patch.x0() + patch.width() - 1);
    if (x1 >= x0) f(y, x0, x1);
  }
}

/// Coefficients of the first `used` terms; returns the variance about the surface.
double solve(const Sums& sums, int used, std::array<double, terms>& coefficients) {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, terms, terms>;
  using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, terms, 1>;
  Matrix normal(used, used);
  Vector right(used);
  for (int a = 0; a < used; ++a) {
    const auto i = static_cast<std::size_t>(a);
    right[a] = sums.signal[u_power[i]][v_power[i]];
    for (int b = 0; b < used; ++b) {
      const auto j = static_cast<std::size_t>(b);
      normal(a, b) = sums.power[u_power[i] + u_power[j]][v_power[i] + v_power[j]];
    }
  }
  const Vector solution = normal.ldlt().solve(right);
  for (int a = 0; a < used; ++a) coefficients[static_cast<std::size_t>(a)] = solution[a];
  return std::max(0.0, sums.squares - solution.dot(right)) / std::max(1, sums.pixels - used);
}

}  // namespace

std::optional<Plateau> Plateau::fit(const Patch& patch, const Conic& conic, double clear_px) {
  const Ellipse ellipse = conic.ellipse();
  const double shrink = 1 - clear_px / ellipse.semi_minor_px;
  if (!(shrink > 0)) return std::nullopt;
  Plateau plateau;
  plateau.centre_ = conic.centre;
  plateau.scale_ = 1 / ellipse.semi_major_px;
  Sums sums;
  for_each_row(patch, conic, shrink, [&](int y, int x0, int x1) {
    const float* row = patch.at(x0, y);
    std::array<double, 5> u{static_cast<double>(x1 - x0 + 1)};
    std::array<double, 3> s{};
    for (int x = x0; x <= x1; ++x) {
      const double at = (x - conic.centre.x()) * plateau.scale_;
      const double at2 = at * at, value = *row++;
      u[1] += at;
      u[2] += at2;
      u[3] += at2 * at;
      u[4] += at2 * at2;
      s[0] += value;
      s[1] += at * value;
      s[2] += at2 * value;
      sums.squares += value * value;
    }
    sums.pixels += x1 - x0 + 1;
    sums.add_row(u, s, (y - conic.centre.y()) * plateau.scale_);
  });
  if (sums.pixels < least_pixels) return std::nullopt;
  const int used = sums.pixels < plane_pixels ? 1 : sums.pixels < paraboloid_pixels ? 3 : 6;
  plateau.pixels_ = sums.pixels;
  plateau.variance_ = solve(sums, used, plateau.c_);
  return plateau;
}

}  // namespace occ::detecting
