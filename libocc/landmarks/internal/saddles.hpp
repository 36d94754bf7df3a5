// SPDX-License-Identifier: Apache-2.0
// Internal: corners where two dark and two bright sectors of a grey image meet, as the inner
// corners of a chessboard. They are saddle points of the smoothed image: local maxima of
//
//     R = I_xy^2 - I_xx I_yy
//
// (Chen, Zhang, "A new sub-pixel detector for x-corners in camera calibration targets", WSCG 2005,
// section 3). A candidate is classified by the grey levels on a circle around it. On a corner, they
// have the period pi, and cross their middle level four times per turn: at its edges. (Bennett,
// Lasenby, "ChESS - Quick and robust detection of chess-board features", Computer Vision and Image
// Understanding 118, 2014, section 3, sample such a circle at 16 points.)
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ::internal::landmarks {

/// Grey image reduced by an integer factor and smoothed. Pixel p of it is at factor p + (factor -
/// 1) / 2 of the full image. Grey levels are those of 8 bits.
class GreyLevel {
 public:
  /// `grey`: one channel; `white`: level that becomes 255.
  GreyLevel(const Image& grey, unsigned white, int factor);

  int width() const { return width_; }
  int height() const { return height_; }
  int factor() const { return factor_; }

  /// True if at() is defined within `margin` around a point.
  bool holds(const Eigen::Vector2d& p, double margin) const {
    const double border = 2 + margin;
    return p.x() >= border && p.y() >= border && p.x() < width_ - 1 - border &&
           p.y() < height_ - 1 - border;
  }
  /// Bilinear interpolation of the smoothed image.
  double at(const Eigen::Vector2d& p) const {
    const int x = static_cast<int>(p.x()), y = static_cast<int>(p.y());
    const auto u = static_cast<float>(p.x() - x), v = static_cast<float>(p.y() - y);
    const float* a = row(y) + x;
    const float* b = row(y + 1) + x;
    return (1 - v) * ((1 - u) * a[0] + u * a[1]) + v * ((1 - u) * b[0] + u * b[1]);
  }
  const float* row(int y) const {
    return smooth_.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
  }

  /// Pixel of the reduced image in the full image, and the reverse.
  Eigen::Vector2d full_px(const Eigen::Vector2d& p) const {
    return factor_ * p + Eigen::Vector2d::Constant(0.5 * (factor_ - 1));
  }

 private:
  int width_, height_, factor_;
  std::vector<float> smooth_;
};

/// Corner between two dark and two bright sectors, in pixels of a GreyLevel. Angles are from x to
/// y.
struct SaddleCorner {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();
  /// Directions of its four edges, by increasing angle. The sector behind edges 0 and 2 is bright.
  std::array<Eigen::Vector2d, 4> edges;
  double contrast = 0;  ///< difference of bright and dark sectors [grey levels]
  /// Standard deviation per axis: of a saddle point in noise that hides a weak corner, by default.
  double sigma_px = 0.3;
};

/// Limits of the classification of a circle of grey levels.
struct CircleLimits {
  double radius_px = 5;
  double max_odd_part = 0.35;  ///< energy of the part without the period pi, relative to the rest
};

/// Moves `p` to the saddle point near it, and classifies the circle around it. nullopt if there is
/// no corner within 2 px of `p`.
std::optional<SaddleCorner> corner_near(const GreyLevel& level, Eigen::Vector2d p,
                                        const CircleLimits& limits);

/// All corners of the image, in the order of their rows.
std::vector<SaddleCorner> find_corners(const GreyLevel& level);

}  // namespace occ::internal::landmarks
