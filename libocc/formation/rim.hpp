// SPDX-License-Identifier: Apache-2.0
// Projects a lamp's rim and the centre of its image, with derivatives by the pose. The image of a
// disc is an ellipse. At the tilt t, its centre differs from the projection of the disc's centre by
// about f (r/Z)^2 sin(t) cos(t). For a rectangle the rim's points are those of its sides, each of
// which is projected; refinement needs no image curve (rim_distance_px). The outline of a lamp in a
// rendered image is in contour.hpp.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Rim of a lamp in the world: `count` points (count >= 8), counter-clockwise seen from the lit
/// side. They include the corners of a rectangle, and the points of a Lame curve on its diagonals
/// if 8 divides the count. Empty for a point lamp.
LIBOCC_API std::vector<Eigen::Vector3d> rim_in_world(const Lamp& lamp, int count);

/// Pixels of the rim; for a point lamp, its single pixel. nullopt if the lamp's dark side is
/// visible or part of the rim is outside the camera's domain.
LIBOCC_API std::optional<std::vector<Eigen::Vector2d>> project_rim(const Lamp& lamp,
                                                                   const Rigid3& cam_from_world,
                                                                   const Camera& camera, int count);

/// Direction (camera frame, z = 1) of the centre of a disc's elliptical image:
///   c = (C_xy C_z + r^2 n_z n_xy) / (C_z^2 - r^2 (1 - n_z^2)),
/// with the centre C and the normal n in the camera's frame. The whole rim must be in front of the
/// camera, C_z > r sqrt(1 - n_z^2); this is not checked.
LIBOCC_API Eigen::Vector3d disc_image_centre(const Eigen::Vector3d& centre_in_cam,
                                             const Eigen::Vector3d& normal_in_cam, double radius_m);

/// Centre of the lamp's image [px]: the centroid of its area (the centre of the ellipse for a disc
/// without lens distortion), or the projection of a point lamp. nullopt as in project_rim.
/// `jacobian` (2x6) is d pixel / d pose perturbation.
LIBOCC_API std::optional<Eigen::Vector2d> project_lamp_centre(
    const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
    Eigen::Matrix<double, 2, 6>* jacobian = nullptr);

/// Ray of a measured rim point. It does not depend on the pose.
struct RimRay {
  Eigen::Vector3d bearing;  ///< direction of the rim point, camera frame
  Eigen::Vector3d across;   ///< d bearing / d (displacement of the pixel along the rim's normal)
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< start of the ray, camera frame [m]
  bool central = true;  ///< true if the ray starts at the frame's origin
};

/// nullopt if the point is outside the camera's domain.
LIBOCC_API std::optional<RimRay> rim_ray(const RimPoint& point, const Camera& camera);

/// Position and shape of a lamp in the camera's frame, computed once for all its rim points.
struct LampInCam {
  LampShape shape;  ///< as in the scene
  /// Camera frame; `normal` and `x_axis` are unit vectors.
  Eigen::Vector3d centre_m, normal, x_axis;
  double radius_m;                         ///< radius of a disc
  Eigen::Vector2d size_m;                  ///< extents of other shapes, along x_axis and across it
  double exponent = 2;                     ///< exponent of a Lame curve
  std::vector<Eigen::Vector2d> corners_m;  ///< corners of a polygon, counter-clockwise
};

/// Moves a lamp to the camera's frame; `lamp` must be validated.
LIBOCC_API LampInCam lamp_in_cam(const Lamp& lamp, const Rigid3& cam_from_world);

/// True if rim_distance_px supports the shape. Refinement uses the image centre of other shapes.
inline bool has_rim_distance(LampShape shape) { return shape != LampShape::point; }

/// Distance [px] along the measured normal from the predicted rim to the measured rim point. The
/// ray is intersected with the lamp's plane at P. With g(P) the signed distance [m] from the rim
/// (positive outside), the residual is g / (dg/d normal). For a disc, g = |P - C| - r. For a side
/// of a rectangle with the unit vector u towards it and half the extent a / 2,
/// g = u . (P - C) - a / 2, and similarly for the sides of a polygon. For a Lame curve,
/// g = (|2x/a|^n + |2y/b|^n)^(1/n) - 1 with the position (x, y) of P in the lamp's plane, without a
/// unit: only the quotient matters. It is exact to first order for any camera model. `jacobian`
/// (1x6) is d residual / d pose perturbation, exact. nullopt if the ray misses the lit side of the
/// plane, if g does not increase along the measured normal (the pose error exceeds the lamp's
/// size), or if the shape has no rim distance.
LIBOCC_API std::optional<double> rim_distance_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                                 const RimRay& ray,
                                                 Eigen::Matrix<double, 1, 6>* jacobian = nullptr);

/// Distance for a lamp in the camera's frame. `jacobian` is d residual / d (rotation of the lamp
/// about its centre, translation of its centre), both in the camera's frame.
LIBOCC_API std::optional<double> rim_distance_px(const LampInCam& lamp, const RimRay& ray,
                                                 Eigen::Matrix<double, 1, 6>* jacobian = nullptr);

}  // namespace occ
