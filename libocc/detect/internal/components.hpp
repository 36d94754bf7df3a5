// SPDX-License-Identifier: Apache-2.0
// Internal: connected components of the pixels above the local threshold, before any sub-pixel
// measurement. Grey levels are those stored in the image (the response is not inverted).
//
// One pass over the image joins runs of bright pixels to those of the row above (8-connected,
// union-find) and sums their moments. Each pixel is visited once; memory holds only the growing
// components and those that are kept.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"

namespace occ::internal::detect {

/// Moments up to second order about pixel (0, 0). They are additive, so parts can be joined.
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
  int saturated_px = 0;      ///< pixels above the threshold with a channel at full scale
  double peak_dn = 0;        ///< brightest pixel, background included
  double background_dn = 0;  ///< local background, mean over the component's pixels
  double noise_dn = 0;       ///< noise of one background pixel, mean over the component's pixels
  Moments grey;              ///< moments of the grey level above background
  Moments shape;             ///< moments of the area (weight 1 per pixel): shape.sum == area_px
  bool touches_border = false;

  /// Union with a component that shares no pixel with this one.
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
    return *this;
  }
};

class Background;

struct ThresholdRule {
  double sigma = 5;                ///< threshold above the local background, in sigmas of the noise
  std::optional<double> level_dn;  ///< absolute threshold, used instead of `sigma`
  double full_scale_dn = 255;      ///< a channel at or above this level counts as saturated
  int min_area_px = 1;             ///< smaller components are dropped
  std::size_t keep = 65536;  ///< the brightest are kept, between keep and 2 keep; bounds memory
};

/// Returns the components of a valid view, in an order that depends on the image alone.
std::vector<Component> find_components(const ImageView& image, const Background& background,
                                       const ThresholdRule& rule);

}  // namespace occ::internal::detect
