// SPDX-License-Identifier: Apache-2.0
// Internal: fits a model of a chessboard's corner to the grey levels around it. With the distances
// q_1 and q_2 of a pixel from the two edges, and the blur s,
//
//     grey = a_0 + a . d + (b_0 + b . d) E(q_1) E(q_2),
//     E(q) = erf(z) + c z^3 exp(-z^2) with z = q / (sqrt(2) s).
//
// The vectors a and b model uneven light over the offset d from the middle of the window, c the
// overshoot of a sharpened picture (small overshoots act as a smaller blur; the term of z^3 is the
// lowest one that does not). The 12 unknowns are estimated by least squares (Levenberg-Marquardt).
//
// The noise of the pixels is correlated by demosaicing, sharpening and JPEG compression. Its
// variance and its correlation are therefore estimated from the residuals, with the weights that
// the pixels have in the position. Only their odd part about the corner counts, as it alone moves
// the corner. Residuals of all corners of the board are pooled for the
// correlation.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/landmarks/internal/grey_image.hpp"

namespace occ::internal::landmarks {

/// Start values of a fit, in pixels of the full image.
struct CornerStart {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Vector2d edges[2];  ///< directions; the sector from the first to the second is bright
  double contrast = 0;       ///< difference of bright and dark sectors [grey levels of the image]
  double blur_px = 1;
  double radius_px = 5;    ///< radius of the window
  bool is_fitted = false;  ///< start values are those of a fit: one window is enough
  /// Convex quadrilaterals whose pixels are not part of the window, for example markers beside the
  /// corner. Pixels within margin_px of them are excluded, too.
  std::vector<std::array<Eigen::Vector2d, 4>> excluded;
  double margin_px = 0;
  /// Bends of the edges by lens distortion: at the distance a from the corner, an edge is off its
  /// tangent by 0.5 a^2 bends_per_px. Zero for straight edges.
  std::array<Eigen::Vector2d, 2> bends_per_px{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
};

constexpr int max_lag_px = 4;  ///< range of the correlation by demosaicing, sharpening and JPEG
/// No lag, and the lags of half the plane.
constexpr int lag_count = 1 + max_lag_px + max_lag_px * (2 * max_lag_px + 1);
using LagSums = std::array<double, lag_count>;

/// Residuals of a window, and the influence of its pixels on the position. Rows are padded with
/// zeros, so that products of pixels at a lag are those of shifted arrays.
struct InfluenceRaster {
  int half = 0, stride = 0;
  std::vector<float> x, y, residual;  ///< zero outside the circle; residuals: their odd part

  void resize(int half_px);
  void set(int u, int v, double influence_x, double influence_y, double off);
  /// Norms of the influences, scaled to the sum 1.
  std::vector<float> weights() const;
  /// Sums of a(p) b(p + lag).
  LagSums lagged_dots(const std::vector<float>& a, const std::vector<float>& b) const;
};

/// A fitted corner with the residuals of its window.
struct CornerFit {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  Eigen::Vector2d edges[2];  ///< as in CornerStart
  double blur_px = 0, contrast = 0;
  InfluenceRaster raster;
  double variance = 0;  ///< variance of the pixels' noise, weighted by their influence
  double misfit = 0;    ///< r.m.s. residual, relative to the contrast
  /// Change of the grey levels and of their step over half a window, relative to the contrast. It
  /// is above 1 if a sector has the wrong tone, which the gradients then imitate.
  double gradient = 0;
};

/// Takes the start values of a second fit from the first one.
void continue_from(const CornerFit& fit, CornerStart& start);

/// False if the fit does not converge near its start, the window leaves the image, or the contrast
/// is not significant.
bool fit_corner(const GreyImage& grey, const CornerStart& start, CornerFit& fit);

/// Covariances [px^2] of fits with the noise that their residuals show.
std::vector<Eigen::Matrix2d> noise_covariances(const std::vector<CornerFit>& fits);

}  // namespace occ::internal::landmarks
