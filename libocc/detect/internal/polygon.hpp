// SPDX-License-Identifier: Apache-2.0
// Internal: outline of a lamp with straight sides, such as a rectangular luminaire or a tube.
//
// The pixels above a level that are connected with the component's centre have an outline, whose
// crossings with rows and columns are split at the corners (Ramer 1972; Douglas, Peucker 1973). It
// is accepted if it is convex, has few sides, and each side is straight but for the distortion of a
// lens. Sides are parabolas, u being the column (row) where a side is crossed by columns (rows):
//     edge(u) = c0 + c1 (u - middle) + c2 (u - middle)^2.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

struct PolygonSide {
  bool column = true;  ///< true: crossed by columns; false: by rows
  double outward = 1;  ///< +1 or -1: direction out of the polygon along a column or row
  double middle = 0;   ///< u where the parabola is expanded
  Eigen::Vector3d by_u = Eigen::Vector3d::Zero();  ///< c0, c1, c2

  double edge(double u) const {
    const double t = u - middle;
    return by_u[0] + t * (by_u[1] + t * by_u[2]);
  }
  double slope(double u) const { return by_u[1] + 2 * by_u[2] * (u - middle); }
  double u_of(const Eigen::Vector2d& px) const { return px[column ? 0 : 1]; }
  Eigen::Vector2d point(double u) const {
    return column ? Eigen::Vector2d(u, edge(u)) : Eigen::Vector2d(edge(u), u);
  }
};

/// A convex polygon, clockwise in the image (y down). corners_px[i] is where sides[i] starts.
struct Polygon {
  std::vector<PolygonSide> sides;
  std::vector<Eigen::Vector2d> corners_px;
  Eigen::Vector2d centroid_px = Eigen::Vector2d::Zero();  ///< centroid of the area
  Eigen::Matrix2d second_moments_px2 =
      Eigen::Matrix2d::Zero();  ///< second central moments of the area
  double area_px2 = 0;

  /// Polygon with straight sides through corners that are clockwise in the image.
  static Polygon through(std::vector<Eigen::Vector2d> corners_px);

  const Eigen::Vector2d& corner_after(std::size_t side) const {
    return corners_px[(side + 1) % corners_px.size()];
  }
  double perimeter_px() const {
    double sum = 0;
    for (std::size_t i = 0; i < sides.size(); ++i) sum += (corner_after(i) - corners_px[i]).norm();
    return sum;
  }
  /// Outward unit normal of the straight line between the ends of a side.
  Eigen::Vector2d normal(std::size_t side) const;

  /// Share of the light that a point keeps under a Gaussian blur of the sides.
  double coverage(const Eigen::Vector2d& px, double blur_px) const;

  /// Rows or columns that cross a side at least `margin_px` from its ends. `opposite` is on the
  /// nearest side that faces this one, infinite without such a side.
  std::vector<RimLine> lines(std::size_t side, double margin_px) const;

  /// Replaces a side by the parabola through these points, weighted by their sigmas. A short side
  /// becomes a line, one with a single point is shifted.
  void fit_side(std::size_t side, const std::vector<RimPoint>& points);

  /// Computes the corners from the sides, and what follows from them. False if the polygon is no
  /// longer convex.
  bool update();
};

/// Light that the sides at an angle leave on a line across a side, under their blur.
class AdjacentSides {
 public:
  AdjacentSides(const Polygon& polygon, const RimLine& line, std::size_t side, double blur_px);

  /// At a coordinate along the line.
  EdgeShare operator()(double along) const;

 private:
  struct Distance {
    double at_edge, by_along;  // [sigmas of the blur], [1 / px]
    double cosine;             // between the outward normals of both sides
  };
  std::vector<Distance> distances_;  // of the sides that matter
  double edge_;
};

/// Polygon of the outline at a level. `blur_px`: sigma of the edges; points near corners, which
/// they round, are ignored.
std::optional<Polygon> find_polygon(const Patch& patch, const Component& component, double level,
                                    double blur_px);

}  // namespace occ::internal::detect
