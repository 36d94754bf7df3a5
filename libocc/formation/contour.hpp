// SPDX-License-Identifier: Apache-2.0
// The rim of a lamp's image prepared for integration: points on the rim, each with its share dy of
// the contour integral, closed integral of F(x, y) dy ~ sum of F(x_i, y_i) dy_i.
//
// A smooth rim is sampled evenly in its own parameter (trapezoid rule: the error falls
// exponentially with the number of points); a rim with corners or bends, or one that lies mostly
// off the image, piece by piece (Gauss-Legendre).
// Tangents come from the camera's Jacobian, so lens distortion costs no accuracy.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

struct ContourPoint {
  Eigen::Vector2d px;
  double dy_px = 0;
};
using Contour = std::vector<ContourPoint>;

/// A contour point with the derivative of its motion by that of the lamp.
struct MovingContourPoint {
  Eigen::Vector2d px;
  Eigen::Vector2d step_px;  ///< the point's share (dx, dy) of the contour; .y() is dy_px above
  /// d (motion of the point x step_px) / d (rotation of the lamp about its centre, translation of
  /// its centre), both in the camera frame: the area that the contour sweeps here.
  Vector6 sweep;
};
using MovingContour = std::vector<MovingContourPoint>;

/// Contour of a lamp's image with points at most about spacing_px apart. Parts so far outside the
/// image that none of their light reaches it are coarser. Returns nullopt if the lamp shows its
/// dark side or part of the rim is outside the camera's domain; an empty contour for a point lamp.
/// Throws std::invalid_argument unless spacing_px > 0.
LIBOCC_API std::optional<Contour> project_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                                  const Camera& camera, double spacing_px);

/// Like project_contour, into `out`, whose storage is reused; false instead of nullopt.
LIBOCC_API bool project_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                const Camera& camera, double spacing_px, Contour& out);

/// Like project_contour, with the motion of each point.
LIBOCC_API std::optional<MovingContour> project_moving_contour(const Lamp& lamp,
                                                               const Rigid3& cam_from_world,
                                                               const Camera& camera,
                                                               double spacing_px);

/// A point of the rim with its share of the contour, both in the camera frame [m]. The contour of a
/// moving lamp follows from these points by moving and projecting them.
struct RimStep {
  Eigen::Vector3d point, step;
};
using RimContour = std::vector<RimStep>;

/// Returns the points of project_contour before their projection.
LIBOCC_API std::optional<RimContour> rim_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                                 const Camera& camera, double spacing_px);

/// Contour through samples of a smooth closed curve, evenly spaced in some parameter; tangents by
/// central differences of order 12. Throws std::invalid_argument for fewer than 13 samples.
LIBOCC_API Contour smooth_contour(const std::vector<Eigen::Vector2d>& rim_px);

}  // namespace occ
