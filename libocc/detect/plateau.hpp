// SPDX-License-Identifier: Apache-2.0
// Internal: the light inside a disc, a smooth surface, fitted where the blur of the rim does not
// reach and carried on across the rim.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <array>
#include <optional>

#include "libocc/detect/ellipse_fit.hpp"
#include "libocc/detect/patch.hpp"

namespace occ::detecting {

/// How far inside the rim, in sigmas of its blur, the plateau's level matters to where the rim is
/// found: minus the mean of z weighted with the blurred edge times its derivative.
inline constexpr double level_depth = 0.564;

class Plateau {
 public:
  /// Least squares over the pixels inside the ellipse that the rim's blur leaves most of their
  /// light: a constant, plane, paraboloid or cubic, whatever the number of pixels bears. Nothing
  /// when there are hardly any.
  static std::optional<Plateau> fit(const Patch& patch, const Conic& conic, double blur_px);

  /// Signal of the unblurred disc at a pixel.
  double operator()(double x, double y) const {
    const double u = (x - centre_.x()) * scale_, v = (y - centre_.y()) * scale_;
    return c_[0] + u * (c_[1] + u * (c_[3] + u * c_[6]) + v * (c_[4] + u * c_[7] + v * c_[8])) +
           v * (c_[2] + v * (c_[5] + v * c_[9]));
  }

  /// Its gradient there.
  Eigen::Vector2d gradient(double x, double y) const {
    const double u = (x - centre_.x()) * scale_, v = (y - centre_.y()) * scale_;
    return scale_ *
           Eigen::Vector2d(
               c_[1] + u * (2 * c_[3] + 3 * u * c_[6] + 2 * v * c_[7]) + v * (c_[4] + v * c_[8]),
               c_[2] + v * (2 * c_[5] + 3 * v * c_[9] + 2 * u * c_[8]) + u * (c_[4] + u * c_[7]));
  }

  bool uniform() const { return uniform_; }      ///< too few pixels to tell a slope
  double level() const { return c_[0]; }         ///< at the centre
  double variance() const { return variance_; }  ///< of a pixel about the surface

  /// Covariance of the slope that the rim sees [DN per pixel], for a unit variance of the pixels.
  const Eigen::Matrix2d& gradient_covariance() const { return gradient_covariance_; }

  /// Variance of the level at the rim, its mean all around, for a unit variance of the pixels.
  double rim_level_variance() const { return rim_level_variance_; }

 private:
  template <int Degree>
  static std::optional<Plateau> fit_surface(const Patch& patch, const Conic& conic, double blur_px,
                                            double shrink);

  Eigen::Vector2d centre_ = Eigen::Vector2d::Zero();
  double scale_ = 1;
  std::array<double, 10> c_{};  // 1, u, v, u^2, u v, v^2, u^3, u^2 v, u v^2, v^3
  bool uniform_ = true;
  double variance_ = 0;
  Eigen::Matrix2d gradient_covariance_ = Eigen::Matrix2d::Zero();
  double rim_level_variance_ = 0;
};

}  // namespace occ::detecting
