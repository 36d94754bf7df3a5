// SPDX-License-Identifier: Apache-2.0
// Internal: a connected set of pixels above the threshold, as the one pass over the image leaves
// it, before anything sub-pixel is measured. Grey levels here are as stored (no response applied).
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <limits>

#include "libocc/core/abi.hpp"

namespace occ::internal::detect {

/// Moments up to the second about pixel (0, 0). They add, so parts of one lamp can be joined.
struct Moments {
  double sum = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;

  Moments& operator+=(const Moments& other) {
    sum += other.sum;
    x += other.x;
    y += other.y;
    xx += other.xx;
    xy += other.xy;
    yy += other.yy;
    return *this;
  }

  Eigen::Vector2d mean() const { return {x / sum, y / sum}; }

  Eigen::Matrix2d variance() const {
    const Eigen::Vector2d m = mean();
    Eigen::Matrix2d out;
    out << xx / sum, xy / sum, xy / sum, yy / sum;
    return out - m * m.transpose();
  }
};

struct Component {
  int x0 = std::numeric_limits<int>::max(), y0 = std::numeric_limits<int>::max();
  int x1 = -1, y1 = -1;      ///< bounding box, both ends included
  int area_px = 0;           ///< pixels above the threshold
  int saturated_px = 0;      ///< of them, pixels with a channel at full scale
  double peak_dn = 0;        ///< brightest pixel, background included
  double background_dn = 0;  ///< local background, mean over the component's pixels
  double noise_dn = 0;       ///< of one background pixel, mean over the component's pixels
  Moments grey;              ///< of grey level above background
  Moments shape;             ///< of ones: shape.sum == area_px
  bool touches_border = false;
  bool striped = false;  ///< joined from rolling-shutter stripes

  /// Makes this the union of both; for parts that share no pixel.
  Component& operator+=(const Component& other) {
    const double total = std::max(1, area_px + other.area_px);
    background_dn = (background_dn * area_px + other.background_dn * other.area_px) / total;
    noise_dn = (noise_dn * area_px + other.noise_dn * other.area_px) / total;
    x0 = std::min(x0, other.x0);
    y0 = std::min(y0, other.y0);
    x1 = std::max(x1, other.x1);
    y1 = std::max(y1, other.y1);
    area_px += other.area_px;
    saturated_px += other.saturated_px;
    peak_dn = std::max(peak_dn, other.peak_dn);
    grey += other.grey;
    shape += other.shape;
    touches_border = touches_border || other.touches_border;
    striped = striped || other.striped;
    return *this;
  }
};

}  // namespace occ::internal::detect
