// SPDX-License-Identifier: Apache-2.0
// Internal: the image columns and rows that cross an ellipse rather head-on, one per rim point.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

/// One crossing. `edge` is a coordinate along the line (y of a column, x of a row); slope and bend
/// are its first and second derivative from line to line.
struct RimLine {
  bool column;  ///< a column of the image; else a row
  int index;    ///< x of the column, y of the row
  double edge;
  double opposite;  ///< where the line crosses the ellipse on the other side
  double outward;   ///< +1 or -1: the way out along the line
  double slope, bend;

  /// Cosine between the line and the rim's normal.
  double cosine() const { return 1 / std::sqrt(1 + slope * slope); }

  Eigen::Vector2d point(double along) const {
    return column ? Eigen::Vector2d(index, along) : Eigen::Vector2d(along, index);
  }

  Eigen::Vector2d normal() const {
    const double cos = outward * cosine(), sin = -slope * cos;
    return column ? Eigen::Vector2d(sin, cos) : Eigen::Vector2d(cos, sin);
  }

  /// Pixels of the line that the patch has, from `low` to `high` (coordinates along the line).
  bool inside(const Patch& patch, int low, int high) const {
    return column ? patch.contains(index, low) && patch.contains(index, high)
                  : patch.contains(low, index) && patch.contains(high, index);
  }

  const float* pixel(const Patch& patch, int along) const {
    return column ? patch.at(index, along) : patch.at(along, index);
  }

  std::ptrdiff_t step(const Patch& patch) const { return column ? patch.width() : 1; }
};

/// Calls f(line) for every column and row whose crossing is no flatter than 45 degrees.
template <typename F>
void for_each_rim_line(const FittedConic& conic, F&& f) {
  const double determinant = conic.shape.determinant();
  for (const bool column : {true, false}) {
    const int u_axis = column ? 0 : 1, v_axis = 1 - u_axis;
    const double uu = conic.shape(u_axis, u_axis), vv = conic.shape(v_axis, v_axis);
    const double uv = conic.shape(0, 1);
    const double u_centre = conic.centre[u_axis], v_centre = conic.centre[v_axis];
    const double extent = std::sqrt(vv / determinant);
    const int last = static_cast<int>(std::floor(u_centre + extent));
    for (int index = static_cast<int>(std::ceil(u_centre - extent)); index <= last; ++index) {
      const double du = index - u_centre;
      const double root = std::sqrt(std::max(0.0, vv - determinant * du * du)) / vv;
      const double middle = -uv * du / vv;
      for (const double sign : {-1.0, 1.0}) {
        const double dv = middle + sign * root;
        const double out_u = uu * du + uv * dv, out_v = uv * du + vv * dv;
        if (std::abs(out_u) > std::abs(out_v)) continue;
        const double slope = -out_u / out_v;
        const double bend = -(uu + 2 * uv * slope + vv * slope * slope) / out_v;
        f(RimLine{column, index, v_centre + dv, v_centre + middle - sign * root,
                  out_v > 0 ? 1.0 : -1.0, slope, bend});
      }
    }
  }
}

}  // namespace occ::internal::detect
