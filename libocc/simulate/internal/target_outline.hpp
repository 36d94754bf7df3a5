// SPDX-License-Identifier: Apache-2.0
// Outlines of printed targets: the black cells of AprilTags (as libapriltag prints the family) and
// other patterns of square cells, and their projection into contours for the coverage integral.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/formation/contour.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ::internal::simulate {

/// Edge from one corner of an outline to the next. Black is on the left, seen from the front (y
/// up).
struct PrintEdge {
  Eigen::Vector2d from, to;
};

/// Outline of the black cells of a pattern of columns x rows cells of side 1. The origin is the
/// upper left corner of the first cell; y is up, and rows go down. The surroundings are white.
std::vector<PrintEdge> cell_outline(int columns, int rows,
                                    const std::function<bool(int column, int row)>& black);

/// Print of a tag in units of half the side of the tag's square, whose corners are at (-1, -1) to
/// (1, 1).
struct TagPrint {
  std::vector<PrintEdge> black;
  double half_width = 1;  ///< half width of the print with the family's quiet zone
  double cell = 0.25;     ///< side of one cell
};

/// Throws std::invalid_argument for an unknown family or an id that the family does not have.
TagPrint tag_print(const std::string& family, int id);

/// Closed outlines in a plane [m], with the inside on the left seen from the front, and circles of
/// one radius.
struct PlaneOutline {
  std::vector<PrintEdge> edges;
  double circle_radius_m = 0;
  std::vector<Eigen::Vector2d> circle_centres_m;
};

/// Outlines centred at the origin.
PlaneOutline rectangle_outline(const Eigen::Vector2d& half_size_m);
PlaneOutline square_outline(double half_side_m);

/// Contour of an outline in the plane z = 0 of `cam_from_plane`, with points at most spacing_px
/// apart. In an image of 360 degrees, columns are those nearest to `near_px`. nullopt if a part is
/// outside the camera's domain or longer than max_length_px.
std::optional<Contour> plane_contour(const PlaneOutline& outline, const Rigid3& cam_from_plane,
                                     const Camera& camera, const Eigen::Vector2d& near_px,
                                     double spacing_px, double max_length_px);

/// Area inside [px^2]; negative if seen from behind.
double contour_area(const Contour& contour);

/// Centroid of the area [px].
Eigen::Vector2d contour_centroid(const Contour& contour);

}  // namespace occ::internal::simulate
