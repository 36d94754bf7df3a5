// SPDX-License-Identifier: Apache-2.0
// Samples the rim of a lamp's image for contour integrals: points on the rim, each with its weight
// dy:
//
//     closed integral of F(x, y) dy  ~  sum of F(x_i, y_i) dy_i.
//
// A smooth rim is sampled evenly in its own parameter (trapezoid rule; the error decreases
// exponentially with the number of points). A rim with corners or strong curvature, or one that is
// mostly outside the image, is sampled piece by piece (Gauss-Legendre). Tangents follow from the
// camera's Jacobian, so lens distortion does not reduce the accuracy.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// A sample of a contour.
struct ContourPoint {
  Eigen::Vector2d px;  ///< position on the contour
  double dy_px = 0;    ///< weight of the sample in an integral over dy
};
using Contour = std::vector<ContourPoint>;  ///< in order along the rim, closed

/// A contour point with its derivative by the lamp's motion.
struct MovingContourPoint {
  Eigen::Vector2d px;       ///< position on the contour
  Eigen::Vector2d step_px;  ///< weight (dx, dy) of the point; .y() is ContourPoint::dy_px
  /// Area of the image that the lamp's motion sweeps here: d (motion of the point x step_px) /
  /// d (rotation of the lamp about its centre, translation of its centre), in the camera's frame.
  Vector6 sweep;
};
using MovingContour = std::vector<MovingContourPoint>;  ///< in order along the rim, closed

/// Contour of a lamp's image, with points at most about spacing_px apart. Parts whose light does
/// not reach the image have wider spacing. Returns nullopt if the lamp's dark side is visible or
/// part of the rim is outside the camera's domain; an empty contour for a point lamp. Throws
/// std::invalid_argument unless spacing_px > 0.
LIBOCC_API std::optional<Contour> project_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                                  const Camera& camera, double spacing_px);

/// Writes the contour into `out`, whose storage is reused. Returns false instead of nullopt.
LIBOCC_API bool project_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                const Camera& camera, double spacing_px, Contour& out);

/// Contour with its derivatives by the lamp's motion.
LIBOCC_API std::optional<MovingContour> project_moving_contour(const Lamp& lamp,
                                                               const Rigid3& cam_from_world,
                                                               const Camera& camera,
                                                               double spacing_px);

/// A point of the rim and its weight, both in the camera's frame [m]. The contour of a moved lamp
/// is this one, moved and projected.
struct RimStep {
  Eigen::Vector3d point, step;  ///< position on the rim, and the vector of line integration there
};
using RimContour = std::vector<RimStep>;  ///< in order along the rim, closed

/// The points of project_contour before projection.
LIBOCC_API std::optional<RimContour> rim_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                                 const Camera& camera, double spacing_px);

/// Contour through samples of a smooth closed curve that are evenly spaced in a parameter. Tangents
/// are central differences of order 12. Throws std::invalid_argument for fewer than 13 samples.
LIBOCC_API Contour smooth_contour(const std::vector<Eigen::Vector2d>& rim_px);

}  // namespace occ
