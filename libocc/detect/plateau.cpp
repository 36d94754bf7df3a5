// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/plateau.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <type_traits>

#include "libocc/core/abi.hpp"
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/free_outline.hpp"
#include "libocc/detect/internal/normal_table.hpp"
#include "libocc/detect/internal/patch.hpp"
#include "libocc/detect/internal/polygon.hpp"

namespace occ::internal::detect {
namespace {

/// Part of its light that a pixel inside the disc keeps under the blur of the rim.
class EllipseCoverage {
 public:
  EllipseCoverage(const FittedConic& conic, double blur_px)
      : xx_(conic.shape(0, 0)),
        xy_(conic.shape(0, 1)),
        yy_(conic.shape(1, 1)),
        determinant_(conic.shape.determinant()),
        blur_(blur_px) {}

  /// (dx, dy): offset from the ellipse's centre. The distance from the rim is measured on the ray
  /// through the pixel and projected to the normal there. Blur moves the edge of a convex shape
  /// inwards by half its curvature times the blur squared.
  double operator()(double dx, double dy) const {
    const double out_x = xx_ * dx + xy_ * dy, out_y = xy_ * dx + yy_ * dy;
    const double form = out_x * dx + out_y * dy;
    const double length2 = out_x * out_x + out_y * out_y;
    // Fast bound: (1 - form) / 2 |out| exceeds the distance by less than half of it.
    if ((1 - form) * (1 - form) > 144 * blur_ * blur_ * length2) return 1;
    const double radius = std::sqrt(form), length = std::sqrt(length2);
    const double distance = radius * (1 - radius) / length;
    const double curvature = determinant_ * form * radius / (length2 * length);
    return table_(distance / blur_ - 0.5 * curvature * blur_).below;
  }

 private:
  double xx_, xy_, yy_, determinant_, blur_;
  const NormalTable& table_ = NormalTable::get();
};

int first_pixel(double v, int low) { return std::max(low, static_cast<int>(std::ceil(v))); }
int last_pixel(double v, int high) { return std::min(high, static_cast<int>(std::floor(v))); }

/// Sums over pixels of u^i v^j, and of these times the signal, for a surface of this degree that is
/// multiplied by the coverage.
template <int Degree>
struct Sums {
  static constexpr int powers = 2 * Degree + 1;
  double power[powers][powers] = {};
  double signal[Degree + 1][Degree + 1] = {};
  double squares = 0;
  int pixels = 0;

  /// Adds a row of pixels that starts at (dx, dy). v is constant, so only powers of u are summed.
  template <typename Coverage>
  void add_row(const float* row, double dx, double dy, int count, double scale,
               const Coverage& cover) {
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

constexpr double clear_sigmas = 1.5;  // distance inside the rim with 93 % of the light [blur sigma]
constexpr double free_clear_sigmas = 2.5;  // with 99 %
// Min number of pixels for degree 0, 1 and 2: with fewer, extrapolation across the rim is unstable.
constexpr int min_pixels = 4, plane_pixels = 30, paraboloid_pixels = 200;
// Min number of pixels for degree 3 and 5: from this size on, the terms of that degree in the light
// of a wide view shift the centre by more than the noise of their estimates.
constexpr int cubic_pixels = 5000, quintic_pixels = 40000;
// Half length of a polygon from which on the terms of degree 3 and 5 are estimated.
constexpr double cubic_polygon_px = 40, quintic_polygon_px = 110;
// Prior of these terms and of the product of places along and across, over the level: the light of
// a wide view. Across a tube, they are unknown otherwise, and extrapolation is unstable. Noise of a
// pixel for it, at least, over the level.
constexpr double high_term_sigma = 0.05, min_noise = 1e-3;
constexpr double ring_hollow = 0.8;  // inner over outer size of the ring for the quintic
constexpr double min_visible = 0.5;  // visible part of the ring below which degree 3 is used

constexpr int terms_of(int degree) { return (degree + 1) * (degree + 2) / 2; }
constexpr int max_terms = terms_of(Plateau::max_degree);

struct Powers {
  int u, v;
};

/// 1, u, v, u^2, u v, v^2, u^3 ...
constexpr std::array<Powers, max_terms> powers_of_terms() {
  std::array<Powers, max_terms> out{};
  std::size_t k = 0;
  for (int degree = 0; degree <= Plateau::max_degree; ++degree)
    for (int v = 0; v <= degree; ++v) out[k++] = {degree - v, v};
  return out;
}
constexpr std::array<Powers, max_terms> term_powers = powers_of_terms();

using Terms = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, max_terms, 1>;
using TermsSquared = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_terms, max_terms>;

template <int Degree>
TermsSquared normal_matrix(const Sums<Degree>& sums, int used) {
  TermsSquared normal(used, used);
  for (int a = 0; a < used; ++a) {
    const Powers& i = term_powers[a];
    for (int b = 0; b < used; ++b) {
      const Powers& j = term_powers[b];
      normal(a, b) = sums.power[i.u + j.u][i.v + j.v];
    }
  }
  return normal;
}

template <int Degree>
Terms right_side(const Sums<Degree>& sums, int used) {
  Terms right(used);
  for (int a = 0; a < used; ++a) {
    const Powers& i = term_powers[a];
    right[a] = sums.signal[i.u][i.v];
  }
  return right;
}

/// Inner part of an ellipse, or a ring along its rim.
class EllipseRegion {
 public:
  /// Between two scaled copies of the ellipse: inside the one scaled by `shrink`, outside the one
  /// scaled by `hollow`.
  EllipseRegion(const FittedConic& conic, double blur_px, double shrink, double hollow)
      : conic_(conic), cover_(conic, blur_px), shrink_(shrink), hollow_(hollow) {}

  const Eigen::Vector2d& centre() const { return conic_.centre; }
  double size_px() const { return conic_.ellipse().semi_major_px; }
  double area_px2() const {
    return pi * (shrink_ * shrink_ - hollow_ * hollow_) / std::sqrt(conic_.shape.determinant());
  }
  double operator()(double dx, double dy) const { return cover_(dx, dy); }

  /// Calls f(y, x0, x1) for its rows of pixels in the patch.
  template <typename F>
  void for_each_row(const Patch& patch, F&& f) const {
    const double xx = conic_.shape(0, 0), xy = conic_.shape(0, 1);
    const double determinant = conic_.shape.determinant();
    const double half_height = shrink_ * std::sqrt(xx / determinant);
    const double cx = conic_.centre.x(), cy = conic_.centre.y();
    const int right = patch.x0() + patch.width() - 1;
    const int y1 = last_pixel(cy + half_height, patch.y0() + patch.height() - 1);
    for (int y = first_pixel(cy - half_height, patch.y0()); y <= y1; ++y) {
      const double dy = y - cy;
      const double middle = cx - xy * dy / xx;
      const auto half_width = [&](double size) {
        return std::sqrt(std::max(0.0, size * size * xx - determinant * dy * dy)) / xx;
      };
      const double root = half_width(shrink_), inner = half_width(hollow_);
      const int x0 = first_pixel(middle - root, patch.x0()), x1 = last_pixel(middle + root, right);
      if (inner > 0) {
        const int left_end = last_pixel(middle - inner, right);
        const int right_start = first_pixel(middle + inner, std::max(patch.x0(), left_end + 1));
        if (left_end >= x0) f(y, x0, left_end);
        if (x1 >= right_start) f(y, right_start, x1);
      } else if (x1 >= x0) {
        f(y, x0, x1);
      }
    }
  }

  /// Calls f(offset from the centre, outward normal) for points around the rim.
  template <typename F>
  void for_each_rim_point(F&& f) const {
    constexpr int points = 16;
    const Eigen::Matrix2d of_circle = ellipse_from_circle(conic_);
    for (int k = 0; k < points; ++k) {
      const double angle = 2 * pi * k / points;
      const Eigen::Vector2d edge = of_circle * Eigen::Vector2d(std::cos(angle), std::sin(angle));
      f(edge, (conic_.shape * edge).normalized());
    }
  }

 private:
  const FittedConic& conic_;
  EllipseCoverage cover_;
  double shrink_, hollow_;
};

/// Unit direction of the largest second moment.
Eigen::Vector2d direction_of(const Eigen::Matrix2d& moments) {
  const double angle = 0.5 * std::atan2(2 * moments(0, 1), moments(0, 0) - moments(1, 1));
  return {std::cos(angle), std::sin(angle)};
}

/// Inner part of a polygon.
class PolygonRegion {
 public:
  /// The pixels at least `depth_px` inside all sides.
  PolygonRegion(const Polygon& polygon, double blur_px, double depth_px)
      : polygon_(polygon), blur_px_(blur_px), depth_px_(depth_px) {}

  const Eigen::Vector2d& centre() const { return polygon_.centroid_px; }
  double size_px() const {
    double size = 0;
    for (const Eigen::Vector2d& corner : polygon_.corners_px)
      size = std::max(size, (corner - polygon_.centroid_px).norm());
    return size;
  }
  double area_px2() const { return polygon_.area_px2; }
  /// Unit direction of the longest extent.
  Eigen::Vector2d direction() const { return direction_of(polygon_.second_moments_px2); }
  double operator()(double dx, double dy) const {
    return polygon_.coverage(polygon_.centroid_px + Eigen::Vector2d(dx, dy), blur_px_);
  }

  template <typename F>
  void for_each_row(const Patch& patch, F&& f) const {
    const int bottom = patch.y0() + patch.height() - 1, right = patch.x0() + patch.width() - 1;
    for (int y = patch.y0(); y <= bottom; ++y) {
      double low = patch.x0(), high = right;  // where all half planes meet the row
      for (std::size_t i = 0; i < polygon_.sides.size(); ++i) {
        const Eigen::Vector2d normal = polygon_.normal(i);
        const double at = polygon_.corners_px[i].dot(normal) - depth_px_ - normal.y() * y;
        constexpr double parallel = 1e-9;
        if (normal.x() > parallel)
          high = std::min(high, at / normal.x());
        else if (normal.x() < -parallel)
          low = std::max(low, at / normal.x());
        else if (at < 0)
          high = low - 1;
      }
      if (!(high >= low)) continue;
      const int x0 = first_pixel(low, patch.x0()), x1 = last_pixel(high, right);
      if (x1 >= x0) f(y, x0, x1);
    }
  }

  template <typename F>
  void for_each_rim_point(F&& f) const {
    constexpr int points_per_side = 4;
    for (std::size_t i = 0; i < polygon_.sides.size(); ++i) {
      const Eigen::Vector2d& from = polygon_.corners_px[i];
      const Eigen::Vector2d along = polygon_.corner_after(i) - from;
      for (int k = 0; k < points_per_side; ++k)
        f(Eigen::Vector2d(from + (k + 0.5) / points_per_side * along - centre()),
          polygon_.normal(i));
    }
  }

 private:
  const Polygon& polygon_;
  double blur_px_, depth_px_;
};

/// Inner part of an outline of any shape.
class FreeRegion {
 public:
  FreeRegion(const FreeOutline& outline, double blur_px, double depth_px)
      : outline_(outline), blur_px_(blur_px), depth_px_(depth_px) {}

  const Eigen::Vector2d& centre() const { return outline_.centroid_px(); }
  double size_px() const { return outline_.reach_px(); }
  double area_px2() const { return outline_.area_px2(); }
  Eigen::Vector2d direction() const { return direction_of(outline_.second_moments_px2()); }
  double operator()(double dx, double dy) const {
    const Eigen::Vector2d& c = centre();
    const double depth_px = outline_.depth_px(static_cast<int>(std::lround(c.x() + dx)),
                                              static_cast<int>(std::lround(c.y() + dy)));
    return NormalTable::get()(depth_px / blur_px_).below;
  }

  template <typename F>
  void for_each_row(const Patch& patch, F&& f) const {
    const int right = patch.x0() + patch.width() - 1;
    for (int y = patch.y0(); y < patch.y0() + patch.height(); ++y)
      for (int x = patch.x0(); x <= right; ++x) {
        const int first = x;
        while (x <= right && outline_.depth_px(x, y) >= depth_px_) ++x;
        if (x > first) f(y, first, x - 1);
      }
  }

  template <typename F>
  void for_each_rim_point(F&& f) const {
    for (const RimLine& line : outline_.lines())
      f(Eigen::Vector2d(line.point(line.edge) - centre()), line.normal());
  }

 private:
  const FreeOutline& outline_;
  double blur_px_, depth_px_;
};

/// Regions whose light may be unknown across a direction: see the priors of fit_surface().
template <typename Region>
constexpr bool may_be_narrow =
    std::is_same_v<Region, PolygonRegion> || std::is_same_v<Region, FreeRegion>;

/// Variance of a pixel by the differences of neighbours in a row.
double noise_between_neighbours(const Patch& patch, const PolygonRegion& region) {
  double sum = 0;
  int count = 0;
  region.for_each_row(patch, [&](int y, int x0, int x1) {
    const float* row = patch.at(x0, y);
    for (int i = 1; i <= x1 - x0; ++i, ++count) sum += square(row[i] - row[i - 1]);
  });
  return count > 0 ? sum / (2 * count) : 0;
}

/// Adds a prior of the product term along and across a polygon, as seen from its own axes. Across a
/// tube, it is unknown otherwise, and turns the sides.
void add_twist_prior(const Eigen::Vector2d& along, double information, TermsSquared& normal) {
  const double sin2 = 2 * along.x() * along.y();
  const Eigen::Vector3d product(-sin2, square(along.x()) - square(along.y()), sin2);
  normal.block<3, 3>(terms_of(1), terms_of(1)) += information * product * product.transpose();
}

/// The terms at a place: those of each degree are those of the previous degree times u, and its
/// last one times v.
Terms terms_at(const Eigen::Vector2d& uv, int used) {
  Terms out(used);
  out[0] = 1;
  for (int first = 0, count = 1; first + count < used; first += count++) {
    out.segment(first + count, count) = uv.x() * out.segment(first, count);
    out[first + 2 * count] = uv.y() * out[first + count - 1];
  }
  return out;
}

/// Mean of the polynomial's terms along the visible part of the rim, `depth_px` inside it, the
/// slope of the plane that fits each term there best, and the part of each that varies with the
/// double angle of the normal.
class RimTerms {
 public:
  template <typename Region>
  RimTerms(const Patch& patch, const Region& region, double depth_px, double scale, int used)
      : mean_(Terms::Zero(used)), by_place_(used, 2), by_angle_(used, 3) {
    Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
    Eigen::Matrix3d angles = Eigen::Matrix3d::Zero();
    by_place_.setZero();
    by_angle_.setZero();
    region.for_each_rim_point([&](const Eigen::Vector2d& edge, const Eigen::Vector2d& normal) {
      const Eigen::Vector2d at = edge - depth_px * normal;
      const Eigen::Vector2d px = region.centre() + at;
      if (!patch.contains(static_cast<int>(px.x()), static_cast<int>(px.y()))) return;
      const Terms terms = terms_at(at * scale, used);
      ++seen_;
      mean_ += terms;
      spread += at * at.transpose();
      by_place_ += terms * at.transpose();
      const Eigen::Vector3d doubled(1, square(normal.x()) - square(normal.y()),
                                    2 * normal.x() * normal.y());
      angles += doubled * doubled.transpose();
      by_angle_ += terms * doubled.transpose();
    });
    if (empty()) return;
    mean_ /= seen_;
    by_place_ = by_place_ * spread.inverse();
    by_angle_ = by_angle_ * angles.inverse();
  }

  bool empty() const { return seen_ < 3; }  ///< too few points for a slope
  const Terms& mean() const { return mean_; }
  const Eigen::Matrix<double, Eigen::Dynamic, 2, 0, max_terms, 2>& slope() const {
    return by_place_;
  }
  auto stretch() const { return by_angle_.rightCols<2>(); }

 private:
  int seen_ = 0;
  Terms mean_;
  Eigen::Matrix<double, Eigen::Dynamic, 2, 0, max_terms, 2> by_place_;
  Eigen::Matrix<double, Eigen::Dynamic, 3, 0, max_terms, 3> by_angle_;
};

}  // namespace

template <int Degree, typename Region>
std::optional<Plateau> Plateau::fit_surface(const Patch& patch, const Region& region,
                                            double blur_px) {
  Plateau plateau;
  plateau.centre_ = region.centre();
  plateau.scale_ = 1 / region.size_px();
  Sums<Degree> sums;
  region.for_each_row(patch, [&](int y, int x0, int x1) {
    const double dy = y - region.centre().y();
    sums.add_row(patch.at(x0, y), x0 - region.centre().x(), dy, x1 - x0 + 1, plateau.scale_,
                 region);
  });
  if (sums.pixels < min_pixels) return std::nullopt;
  plateau.degree_ = Degree > 3 && sums.pixels < min_visible * region.area_px2() ? 3
                    : Degree > 2                                                ? Degree
                    : sums.pixels < plane_pixels                                ? 0
                    : sums.pixels < paraboloid_pixels                           ? 1
                                                                                : 2;
  const int used = terms_of(plateau.degree_);
  const Terms right = right_side(sums, used);
  TermsSquared normal = normal_matrix(sums, used);
  plateau.level_ = sums.signal[0][0] / sums.power[0][0];
  if constexpr (may_be_narrow<Region>) {
    const double level = plateau.level_;
    const double variance = std::max(patch.noise().variance(level), square(min_noise * level));
    const double information = variance / square(high_term_sigma * level);
    for (int a = terms_of(2); a < used; ++a) normal(a, a) += information;
    if (used >= terms_of(2)) add_twist_prior(region.direction(), information, normal);
  }
  const Eigen::LDLT<TermsSquared> solver(normal);
  const Terms solution = solver.solve(right);
  for (int a = 0; a < used; ++a) {
    const Powers& p = term_powers[a];
    plateau.c_[p.u * (max_degree + 1) + p.v] = solution[a];
  }
  plateau.variance_ =
      std::max(0.0, sums.squares - solution.dot(right)) / std::max(1, sums.pixels - used);
  if constexpr (std::is_same_v<Region, PolygonRegion>) {
    const double texture = plateau.variance_ - noise_between_neighbours(patch, region);
    plateau.texture_ = std::sqrt(std::max(0.0, texture)) / plateau.level_;
    plateau.terms_covariance_ = solver.solve(TermsSquared::Identity(used, used));
  }
  const RimTerms rim(patch, region, level_depth * blur_px, plateau.scale_, used);
  if (rim.empty()) return plateau;
  plateau.rim_level_variance_ = rim.mean().dot(solver.solve(rim.mean()));
  if (plateau.degree_ > 0)
    plateau.gradient_covariance_ = rim.slope().transpose() * solver.solve(rim.slope());
  if (plateau.degree_ > 1) {
    const Eigen::Matrix<double, Eigen::Dynamic, 2, 0, max_terms, 2> stretch = rim.stretch();
    plateau.rim_stretch_covariance_ = stretch.transpose() * solver.solve(stretch);
  }
  return plateau;
}

double Plateau::level_covariance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const {
  const auto used = static_cast<int>(terms_covariance_.rows());
  return terms_at((a - centre_) * scale_, used)
      .dot(terms_covariance_ * terms_at((b - centre_) * scale_, used));
}

std::optional<Plateau> Plateau::fit(const Patch& patch, const FittedConic& conic, double blur_px,
                                    double hole) {
  const Ellipse ellipse = conic.ellipse();
  const double margin = clear_sigmas * blur_px / ellipse.semi_minor_px;
  const double shrink = 1 - margin;
  if (!(shrink > 0)) return std::nullopt;
  if (hole > 0) {
    // Neither the pixels nor the profiles across the rim may contain the edge of the hole.
    const double hollow = hole + window_sigmas * blur_px / ellipse.semi_minor_px;
    if ((1 - hollow) * ellipse.semi_minor_px < window_sigmas * blur_px) return std::nullopt;
    return fit_surface<2>(patch, EllipseRegion(conic, blur_px, shrink, hollow), blur_px);
  }
  const double area = pi * ellipse.semi_major_px * ellipse.semi_minor_px * shrink * shrink;
  if (area < quintic_pixels) {
    const EllipseRegion disc(conic, blur_px, shrink, 0);
    return area < cubic_pixels ? fit_surface<2>(patch, disc, blur_px)
                               : fit_surface<3>(patch, disc, blur_px);
  }
  return fit_surface<5>(patch, EllipseRegion(conic, blur_px, shrink, ring_hollow), blur_px);
}

std::optional<Plateau> Plateau::fit(const Patch& patch, const Polygon& polygon, double blur_px) {
  const PolygonRegion region(polygon, blur_px, clear_sigmas * blur_px);
  if (region.size_px() < cubic_polygon_px) return fit_surface<2>(patch, region, blur_px);
  return region.size_px() < quintic_polygon_px ? fit_surface<3>(patch, region, blur_px)
                                               : fit_surface<5>(patch, region, blur_px);
}

std::optional<Plateau> Plateau::fit(const Patch& patch, const FreeOutline& outline,
                                    double blur_px) {
  // The outline is that at one level, which the gradient of the light tilts: pixels near it, whose
  // coverage depends on that, are used only where there are no others.
  for (const double depth_sigmas : {free_clear_sigmas, clear_sigmas}) {
    const FreeRegion region(outline, blur_px, depth_sigmas * blur_px);
    std::optional<Plateau> plateau = region.size_px() < cubic_polygon_px
                                         ? fit_surface<2>(patch, region, blur_px)
                                         : fit_surface<3>(patch, region, blur_px);
    if (plateau) return plateau;
  }
  return std::nullopt;
}

}  // namespace occ::internal::detect
