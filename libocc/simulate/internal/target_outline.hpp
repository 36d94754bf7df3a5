// SPDX-License-Identifier: Apache-2.0
// Internal: outlines drawn on a plane, projected into contours that coverage is integrated along.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/formation/contour.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/simulate/internal/tag_print.hpp"

namespace occ::internal::simulate {

/// Closed outlines in a plane [m], inside on the left seen from the front; and a circle about the
/// origin, where its radius is not zero.
struct PlaneOutline {
  std::vector<PrintEdge> edges;
  double circle_radius_m = 0;
};

/// About the origin.
PlaneOutline rectangle_outline(const Eigen::Vector2d& half_size_m);
PlaneOutline square_outline(double half_side_m);

/// Contour of an outline whose plane is z = 0 of `cam_from_plane`, points at most spacing_px apart,
/// columns those nearest to `near_px` where the image repeats itself. Nothing when a part is
/// outside the camera's domain or larger than max_length_px.
std::optional<Contour> plane_contour(const PlaneOutline& outline, const Rigid3& cam_from_plane,
                                     const Camera& camera, const Eigen::Vector2d& near_px,
                                     double spacing_px, double max_length_px);

/// Area inside [px^2], negative when it is seen from behind.
double contour_area(const Contour& contour);

/// Centroid of the area.
Eigen::Vector2d contour_centroid(const Contour& contour);

}  // namespace occ::internal::simulate
