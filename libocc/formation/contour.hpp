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

/// A contour point together with how it moves when the lamp does.
struct MovingContourPoint {
  Eigen::Vector2d px;
  Eigen::Vector2d step_px;  ///< the point's share (dx, dy) of the contour; .y() is dy_px above
  /// d (motion of the point x step_px) / d (turn of the lamp about its centre, shift of its
  /// centre), both in the camera's frame: what the lamp's motion sweeps of the image here.
  Vector6 sweep;
};
using MovingContour = std::vector<MovingContourPoint>;

/// Contour of a lamp's image, points at most about spacing_px apart; coarser in
/// parts that are so far off the image that no light of theirs reaches it. Nothing when the lamp
/// shows its dark side or part of the rim is outside the camera's domain; empty for a point lamp.
/// Throws std::invalid_argument unless spacing_px > 0.
LIBOCC_API std::optional<Contour> project_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                                  const Camera& camera, double spacing_px);

/// The same into `out`, whose storage is used again; false for nothing.
LIBOCC_API bool project_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                const Camera& camera, double spacing_px, Contour& out);

/// The same contour with its motion.
LIBOCC_API std::optional<MovingContour> project_moving_contour(const Lamp& lamp,
                                                               const Rigid3& cam_from_world,
                                                               const Camera& camera,
                                                               double spacing_px);

/// A point of the rim itself with its share of the contour, both in the camera's frame [m]: the
/// contour of a lamp that moves is this one's, moved and projected.
struct RimStep {
  Eigen::Vector3d point, step;
};
using RimContour = std::vector<RimStep>;

/// The points of project_contour before their projection.
LIBOCC_API std::optional<RimContour> rim_contour(const Lamp& lamp, const Rigid3& cam_from_world,
                                                 const Camera& camera, double spacing_px);

/// Contour through samples of a smooth closed curve, evenly spaced in some parameter; tangents by
/// central differences of order 12. Throws std::invalid_argument for fewer than 13 samples.
LIBOCC_API Contour smooth_contour(const std::vector<Eigen::Vector2d>& rim_px);

}  // namespace occ
