// SPDX-License-Identifier: Apache-2.0
// Internal: what the two rim measurements share: a first outline, accurate to about 0.1 px (the
// ellipse through the points where rows and columns first exceed a level, seen from outside), and
// the image rows and columns that cross an ellipse at a steep angle, one for each rim point.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

struct Outline {
  FittedConic conic;
  bool merged = false;  ///< the points do not fit one ellipse
};

/// Mean signal weighted by signal; close to the level of the plateau, if the blob has one.
double weighted_mean_signal(const Patch& patch, const Component& component);

/// Points where the signal crosses `level`, linearly interpolated: along columns where the
/// outline's normal (image gradient) is within 45 degrees of vertical, else along rows. Sigma is 1
/// for all.
std::vector<RimPoint> scan_outline(const Patch& patch, const Component& component, double level);

/// Ellipse through these crossings; empty when they do not determine one.
std::optional<Outline> find_outline(const Patch& patch, const Component& component, double level);

/// An image row or column that crosses the ellipse. `edge` is a coordinate along it (y of a column,
/// x of a row); slope and bend are the first and second derivative of `edge` by `index`.
struct RimLine {
  bool column;  ///< true: a column of the image; false: a row
  int index;    ///< x of the column or y of the row
  double edge;
  double opposite;  ///< coordinate of the crossing on the opposite side
  double outward;   ///< +1 or -1: direction out of the ellipse along the line
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

  /// True if the patch contains the pixels of the line from `low` to `high` (coordinates along it).
  bool inside(const Patch& patch, int low, int high) const {
    return column ? patch.contains(index, low) && patch.contains(index, high)
                  : patch.contains(low, index) && patch.contains(high, index);
  }

  const float* pixel(const Patch& patch, int along) const {
    return column ? patch.at(index, along) : patch.at(along, index);
  }

  std::ptrdiff_t step(const Patch& patch) const { return column ? patch.width() : 1; }
};

/// Light at a place near an edge that other edges leave: `share` of that by the edge alone, plus
/// `mixed` times the density of the edge's blur. The latter is the first term of the series of the
/// bivariate normal distribution; it is zero for edges at right angles.
struct EdgeShare {
  double share = 1, mixed = 0;
};

/// Calls f(line) for every column and row that crosses the ellipse at 45 degrees or more.
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
