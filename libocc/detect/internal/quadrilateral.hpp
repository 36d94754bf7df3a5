// SPDX-License-Identifier: Apache-2.0
// Internal: recognises the image of a rectangular lamp. Its outline is not an ellipse, as that of
// several lamps in one blob, but it is convex and has four corners.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/patch.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {

/// Level of the outline over the mean level. An unevenly lit lamp has little light somewhere, and a
/// lower level moves the outline of an evenly lit one outwards on all sides.
inline constexpr double outline_level = 0.25;

/// Centre of the area of a component that looks like a quadrilateral [px]: its pixels above a share
/// of its level fill their convex hull, and four of the hull's corners span most of it. Empty
/// otherwise. Its error is a fraction of a pixel, but it does not depend on how evenly the lamp is
/// lit.
std::optional<Eigen::Vector2d> quadrilateral_centre(const Patch& patch, const Component& component);

/// Sides and corners of such a component, to about half a pixel: from where the light falls to half
/// of that nearby, on each row or column across a side. For lamps whose light is too uneven, too
/// clipped or too much altered by the camera for measure_polygon(). Empty if a side is not
/// straight.
std::optional<PolygonRim> measure_quadrilateral(const Patch& patch, const Component& component);

}  // namespace occ::internal::detect
