// SPDX-License-Identifier: Apache-2.0
// Internal: the signal inside a rim as a polynomial surface ("plateau"), fitted to pixels that the
// blur of the rim hardly affects and extrapolated across the rim.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

/// Effective distance inside the rim, in sigmas of its blur, at which the plateau's level affects
/// the measured rim: minus the mean of z weighted with the blurred edge times its derivative.
inline constexpr double level_depth = 0.564;

inline constexpr double window_sigmas = 3;  ///< half width of a rim's profile [sigma of the blur]

class FreeOutline;
struct Polygon;

class Plateau {
 public:
  /// Least-squares fit to the pixels inside the rim that keep most of their light under the
  /// rim's blur: a polynomial of degree 0 to 3, depending on the number of pixels; degree 5 on a
  /// ring along the rim for large discs, whose brightness varies more. Empty for fewer than four
  /// pixels. `hole`: of a ring lamp, its inner over its outer size; 0 for a disc.
  static std::optional<Plateau> fit(const Patch& patch, const FittedConic& conic, double blur_px,
                                    double hole = 0);
  static std::optional<Plateau> fit(const Patch& patch, const Polygon& polygon, double blur_px);
  /// Needs FreeOutline::measure_depths().
  static std::optional<Plateau> fit(const Patch& patch, const FreeOutline& outline, double blur_px);

  /// Signal of the unblurred lamp at a pixel.
  double operator()(double x, double y) const {
    const double u = (x - centre_.x()) * scale_, v = (y - centre_.y()) * scale_;
    if (degree_ <= 2)  // fast path: most lamps, and most of the run time
      return of(0, 0) + u * (of(1, 0) + u * of(2, 0) + v * of(1, 1)) +
             v * (of(0, 1) + v * of(0, 2));
    double sum = 0;
    for (int i = degree_; i >= 0; --i) sum = sum * u + in_v(i, v);
    return sum;
  }

  /// Gradient of that signal at a pixel.
  Eigen::Vector2d gradient(double x, double y) const {
    const double u = (x - centre_.x()) * scale_, v = (y - centre_.y()) * scale_;
    double sum = 0, by_u = 0, by_v = 0;
    for (int i = degree_; i >= 0; --i) {
      by_u = by_u * u + sum;
      sum = sum * u + in_v(i, v);
      double slope = 0;
      for (int j = degree_ - i; j >= 1; --j) slope = slope * v + j * of(i, j);
      by_v = by_v * u + slope;
    }
    return scale_ * Eigen::Vector2d(by_u, by_v);
  }

  bool uniform() const { return degree_ == 0; }  ///< true: too few pixels to estimate a slope
  double level() const { return level_; }        ///< mean signal over the pixels
  double variance() const { return variance_; }  ///< variance of a pixel about the surface

  /// Scatter of the pixels about the surface, beyond the noise that neighbouring pixels show, over
  /// the level; polygons only.
  double texture() const { return texture_; }

  /// Covariance of the slope at the rim [DN per pixel], for unit variance of the pixels.
  const Eigen::Matrix2d& gradient_covariance() const { return gradient_covariance_; }

  /// Variance of the mean level along the rim, for unit variance of the pixels.
  double rim_level_variance() const { return rim_level_variance_; }

  /// Covariance of the parts of the level along the rim that vary with n_x^2 - n_y^2 and 2 n_x n_y,
  /// for its normal n and unit variance of the pixels.
  const Eigen::Matrix2d& rim_stretch_covariance() const { return rim_stretch_covariance_; }

  /// Covariance of the signals at two pixels, for unit variance of the pixels; polygons only.
  double level_covariance(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;

  static constexpr int max_degree = 5;

 private:
  /// Coefficient of u^i v^j.
  double of(int i, int j) const { return c_[i * (max_degree + 1) + j]; }

  double in_v(int i, double v) const {
    double sum = 0;
    for (int j = degree_ - i; j >= 0; --j) sum = sum * v + of(i, j);
    return sum;
  }

  template <int Degree, typename Region>
  static std::optional<Plateau> fit_surface(const Patch& patch, const Region& region,
                                            double blur_px);

  Eigen::Vector2d centre_ = Eigen::Vector2d::Zero();
  double scale_ = 1;
  int degree_ = 0;
  std::array<double, (max_degree + 1) * (max_degree + 1)> c_{};
  double level_ = 0;
  double variance_ = 0;
  double texture_ = 0;
  Eigen::Matrix2d gradient_covariance_ = Eigen::Matrix2d::Zero();
  double rim_level_variance_ = 0;
  Eigen::MatrixXd terms_covariance_;  // of the coefficients, polygons only
  Eigen::Matrix2d rim_stretch_covariance_ = Eigen::Matrix2d::Zero();
};

}  // namespace occ::internal::detect
