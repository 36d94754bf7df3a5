// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/plateau.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "libocc/detect/normal_table.hpp"

namespace occ::detecting {
namespace {

// Fewer pixels than this leave a surface too free where it is carried on across the rim.
constexpr double clear_sigmas = 1.5;  // of blur inside the rim: 93 % of the light is there
constexpr int least_pixels = 4, plane_pixels = 30, paraboloid_pixels = 200;
// From here on the cubic terms of the light of a wide view move the centre by more than their own
// noise does.
constexpr int cubic_pixels = 15000;

constexpr std::size_t terms = 10;
constexpr std::array<std::size_t, terms> u_power = {0, 1, 0, 2, 1, 0, 3, 2, 1, 0};
constexpr std::array<std::size_t, terms> v_power = {0, 0, 1, 0, 1, 2, 0, 1, 2, 3};

double square(double v) { return v * v; }

/// Part of the light that the blur of the rim leaves to a pixel inside.
class Cover {
 public:
  Cover(const Conic& conic, double blur_px)
      : xx_(conic.shape(0, 0)),
        xy_(conic.shape(0, 1)),
        yy_(conic.shape(1, 1)),
        determinant_(conic.shape.determinant()),
        blur_(blur_px) {}

  /// (dx, dy): from the ellipse's centre. The distance is that of the rim on the ray through the
  /// pixel, along the normal there; blur moves the edge of a convex shape inwards by half its
  /// curvature times the blur squared.
  double operator()(double dx, double dy) const {
    const double out_x = xx_ * dx + xy_ * dy, out_y = xy_ * dx + yy_ * dy;
    const double form = out_x * dx + out_y * dy;
    const double length2 = out_x * out_x + out_y * out_y;
    // Cheap and sure: (1 - form) / 2 |out| is more than the distance by less than half of it.
    if (square(1 - form) > square(12 * blur_) * length2) return 1;
    const double radius = std::sqrt(form), length = std::sqrt(length2);
    const double distance = radius * (1 - radius) / length;
    const double curvature = determinant_ * form * radius / (length2 * length);
    return table_(distance / blur_ - 0.5 * curvature * blur_).below;
  }

 private:
  double xx_, xy_, yy_, determinant_, blur_;
  const NormalTable& table_ = NormalTable::get();
};

/// Sums over pixels of u^i v^j, and of these times the signal, of a surface of this degree seen
/// through `cover`.
template <int Degree>
struct Sums {
  static constexpr int powers = 2 * Degree + 1;
  double power[powers][powers] = {};
  double signal[Degree + 1][Degree + 1] = {};
  double squares = 0;
  int pixels = 0;

  /// A row of pixels from (dx, dy) on; v is common to it, only powers of u are summed.
  void add_row(const float* row, double dx, double dy, int count, double scale,
               const Cover& cover) {
    double u[powers] = {}, s[Degree + 1] = {};
    for (int i = 0; i < count; ++i, dx += 1) {
      const double part = cover(dx, dy), at = dx * scale, value = row[i];
      double area = part * part, seen = part * value;
      for (int k = 0; k < powers; ++k, area *= at) u[k] += area;
      for (int k = 0; k <= Degree; ++k, seen *= at) s[k] += seen;
      squares += value * value;
    }
    pixels += count;
    double factor = 1;
    for (int j = 0; j < powers; ++j, factor *= dy * scale) {
      for (int i = 0; i + j < powers; ++i) power[i][j] += factor * u[i];
      for (int i = 0; i + j <= Degree; ++i) signal[i][j] += factor * s[i];
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
template <int Degree>
double solve(const Sums<Degree>& sums, int used, std::array<double, terms>& coefficients) {
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

std::optional<Plateau> Plateau::fit(const Patch& patch, const Conic& conic, double blur_px) {
  const Ellipse ellipse = conic.ellipse();
  const double shrink = 1 - clear_sigmas * blur_px / ellipse.semi_minor_px;
  if (!(shrink > 0)) return std::nullopt;
  const double area = 3.14159 * ellipse.semi_major_px * ellipse.semi_minor_px * shrink * shrink;
  return area < cubic_pixels ? fit_surface<2>(patch, conic, blur_px, shrink)
                             : fit_surface<3>(patch, conic, blur_px, shrink);
}

template <int Degree>
std::optional<Plateau> Plateau::fit_surface(const Patch& patch, const Conic& conic, double blur_px,
                                            double shrink) {
  const Ellipse ellipse = conic.ellipse();
  Plateau plateau;
  plateau.centre_ = conic.centre;
  plateau.scale_ = 1 / ellipse.semi_major_px;
  const Cover cover(conic, blur_px);
  Sums<Degree> sums;
  for_each_row(patch, conic, shrink, [&](int y, int x0, int x1) {
    const double dy = y - conic.centre.y();
    sums.add_row(patch.at(x0, y), x0 - conic.centre.x(), dy, x1 - x0 + 1, plateau.scale_, cover);
  });
  if (sums.pixels < least_pixels) return std::nullopt;
  const int used = Degree == 3                       ? 10
                   : sums.pixels < plane_pixels      ? 1
                   : sums.pixels < paraboloid_pixels ? 3
                                                     : 6;
  plateau.uniform_ = used == 1;
  plateau.variance_ = solve(sums, used, plateau.c_);
  // A line in q = (r / r_most)^2, which is uniform in 0..1 over a disc, carried on to the rim.
  const double q = square((1 - level_depth * blur_px / ellipse.semi_minor_px) / shrink);
  plateau.rim_level_variance_ = (used > 3 ? 1 + 12 * square(q - 0.5) : 1) / sums.pixels;
  if (used > 1) {
    Eigen::Matrix2d normal;
    normal << sums.power[2][0], sums.power[1][1], sums.power[1][1], sums.power[0][2];
    // Cubic terms free the slope at the rim: Zernike's tilt 2 r and coma sqrt(8) (3 r^3 - 2 r).
    const double freedom = used > 6 ? 1 + 2 * square(3 * q - 2) : 1;
    plateau.gradient_covariance_ = freedom * plateau.scale_ * plateau.scale_ * normal.inverse();
  }
  return plateau;
}

}  // namespace occ::detecting
