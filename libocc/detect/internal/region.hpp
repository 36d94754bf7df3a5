// SPDX-License-Identifier: Apache-2.0
// Internal: the bright pixels around the centre of a component, and where rows and columns leave
// them.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/flood.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

/// Crossing of the outline of a region with a row or a column.
struct RegionCrossing {
  Eigen::Vector2d px;
  bool column;
  double angle;  ///< about the centre
};

/// Pixels above a level that are connected with a start, by rows and columns.
class Region {
 public:
  Region(const Patch& patch, const Component& component, double level)
      : patch_(patch), level_(level), is_cut_(component.touches_border) {
    const Eigen::Vector2d centre = component.shape.mean();
    const int x = static_cast<int>(std::lround(centre.x()));
    const int y = static_cast<int>(std::lround(centre.y()));
    inside_.assign(static_cast<std::size_t>(patch.width()) * patch.height(), 0);
    if (!is_above(x, y)) return;
    inside_[at(x, y)] = 1;
    const auto take = [&](int px, int py) {
      if (!is_above(px, py) || inside_[at(px, py)]) return false;
      inside_[at(px, py)] = 1;
      return true;
    };
    for (const auto& [px, py] : flood({x, y}, side_steps, take)) {
      ++area_;
      sum_ += Eigen::Vector2d(px, py);
    }
  }

  int area_px() const { return area_; }

  /// Crossings where the outline is steep to a row or column, around the centre. A row or column
  /// that leaves the region and enters it again is no part of a convex shape: empty then.
  std::vector<RegionCrossing> crossings() const {
    std::vector<RegionCrossing> out;
    const Eigen::Vector2d centre = sum_ / std::max(1, area_);
    int gaps = 0, lines = 0;
    for (const bool column : {true, false}) {
      const int u0 = column ? patch_.x0() : patch_.y0();
      const int count = column ? patch_.width() : patch_.height();
      const int v0 = column ? patch_.y0() : patch_.x0();
      const int length = column ? patch_.height() : patch_.width();
      for (int u = u0; u < u0 + count; ++u) {
        int first = -1, last = -1, pixels = 0;
        for (int v = v0; v < v0 + length; ++v) {
          if (!contains(column, u, v)) continue;
          if (pixels++ == 0) first = v;
          last = v;
        }
        if (pixels == 0) continue;
        ++lines;
        gaps += last - first + 1 > pixels;
        add(column, u, first, -1, centre, out);
        add(column, u, last, 1, centre, out);
      }
    }
    constexpr int noisy = 20;  // one line in this many may have a dark pixel
    if (noisy * gaps > lines) out.clear();
    std::sort(out.begin(), out.end(),
              [](const RegionCrossing& a, const RegionCrossing& b) { return a.angle < b.angle; });
    return out;
  }

 private:
  bool is_above(int x, int y) const { return patch_.contains(x, y) && *patch_.at(x, y) > level_; }
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y - patch_.y0()) * static_cast<std::size_t>(patch_.width()) +
           static_cast<std::size_t>(x - patch_.x0());
  }
  bool contains(bool column, int u, int v) const {
    return inside_[column ? at(u, v) : at(v, u)] != 0;
  }

  /// Interpolates between the last pixel inside and the next one. The image border, which cuts a
  /// lamp, is a side.
  void add(bool column, int u, int v, int outward, const Eigen::Vector2d& centre,
           std::vector<RegionCrossing>& out) const {
    const int x = column ? u : v, y = column ? v : u;
    const int dx = column ? 0 : outward, dy = column ? outward : 0;
    const Eigen::Vector2d direction(dx, dy);
    const auto add_at = [&](double fraction) {
      const Eigen::Vector2d px = Eigen::Vector2d(x, y) + fraction * direction, arm = px - centre;
      out.push_back({px, column, std::atan2(arm.y(), arm.x())});
    };
    if (is_cut_ && !patch_.contains(x + dx, y + dy)) return add_at(0.5);
    for (const int side : {-1, 1})
      if (!patch_.contains(x + side, y + side) || !patch_.contains(x + dx + side, y + dy + side))
        return;
    const float* inside = patch_.at(x, y);
    const float* outside = patch_.at(x + dx, y + dy);
    const std::ptrdiff_t row = patch_.width();
    const Eigen::Vector2d gradient(inside[1] - inside[-1] + outside[1] - outside[-1],
                                   inside[row] - inside[-row] + outside[row] - outside[-row]);
    if (2 * square(gradient.dot(direction)) < gradient.squaredNorm()) return;
    add_at((*inside - level_) / (*inside - *outside));
  }

  const Patch& patch_;
  double level_;
  bool is_cut_;
  std::vector<char> inside_;
  int area_ = 0;
  Eigen::Vector2d sum_ = Eigen::Vector2d::Zero();
};

}  // namespace occ::internal::detect
