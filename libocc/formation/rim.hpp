// SPDX-License-Identifier: Apache-2.0
// Geometry of a lamp's image: the projected rim, the centre of the image, and their derivatives by
// the pose. The image of a disc is an ellipse whose centre is not the projected centre of the disc;
// the difference is about f (r/Z)^2 sin(t) cos(t) at tilt t.
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
/// side; a rectangle's corners are always among them, and a Lame curve's points on its diagonals
/// when 8 divides the count. Empty for a point lamp.
LIBOCC_API std::vector<Eigen::Vector3d> rim_in_world(const Lamp& lamp, int count);

/// Pixels of the rim, or nullopt if the lamp shows its dark side or part of the rim is outside the
/// camera's domain. For a point lamp: its single pixel.
LIBOCC_API std::optional<std::vector<Eigen::Vector2d>> project_rim(const Lamp& lamp,
                                                                   const Rigid3& cam_from_world,
                                                                   const Camera& camera, int count);

/// Direction (camera frame, z = 1) of the centre of a disc's elliptical image:
///   c = (C_xy C_z + r^2 n_z n_xy) / (C_z^2 - r^2 (1 - n_z^2)),  C centre, n normal in the camera's
///   frame.
/// Throws nothing. Requires that the whole rim is in front of the camera (C_z > r sqrt(1 - n_z^2)).
LIBOCC_API Eigen::Vector3d disc_image_centre(const Eigen::Vector3d& centre_in_cam,
                                             const Eigen::Vector3d& normal_in_cam, double radius_m);

/// Centroid of the area of the lamp's image (the centre of the ellipse for a disc without lens
/// distortion), or the projection of a point lamp; nullopt like project_rim. `jacobian` (2x6):
/// d pixel / d pose perturbation.
LIBOCC_API std::optional<Eigen::Vector2d> project_lamp_centre(
    const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
    Eigen::Matrix<double, 2, 6>* jacobian = nullptr);

/// A measured rim point as a ray. It does not depend on the pose and is prepared once.
struct RimRay {
  Eigen::Vector3d bearing;  ///< direction to the rim point, camera frame
  Eigen::Vector3d across;   ///< d bearing / d (pixel along the rim's normal)
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< start of the ray, camera frame [m]
  bool central = true;                               ///< the ray starts at the origin of the frame
};

/// Returns nullopt if the point is outside the camera's domain.
LIBOCC_API std::optional<RimRay> rim_ray(const RimPoint& point, const Camera& camera);

/// Pose and shape of a lamp in the camera frame, prepared once for all its rim points.
struct LampInCam {
  LampShape shape;
  Eigen::Vector3d centre_m, normal, x_axis;
  double radius_m;
  Eigen::Vector2d size_m;
};

LIBOCC_API LampInCam lamp_in_cam(const Lamp& lamp, const Rigid3& cam_from_world);

/// True if rim_distance_px supports the shape; refine uses the centres of the other shapes.
inline bool has_rim_distance(LampShape shape) {
  return shape == LampShape::disc || shape == LampShape::rectangle;
}

/// Distance [px] along the measured normal from the predicted rim to the measured rim point, by
/// intersecting the ray with the lamp's plane: with P the intersection and g(P) its signed distance
/// [m] from the rim (positive outside), the residual is g / (dg/d normal). Exact for any camera
/// model to first order in the residual. `jacobian` (1x6): d residual / d pose perturbation, exact.
/// Returns nullopt if the ray misses the lit side of the plane, if the distance does not grow along
/// the measured normal (the pose error exceeds the lamp's size), or unless has_rim_distance.
LIBOCC_API std::optional<double> rim_distance_px(const Lamp& lamp, const Rigid3& cam_from_world,
                                                 const RimRay& ray,
                                                 Eigen::Matrix<double, 1, 6>* jacobian = nullptr);

/// Like rim_distance_px for a prepared lamp; `jacobian` is d residual / d (rotation of the lamp
/// about its centre, translation of its centre), both in the camera frame.
LIBOCC_API std::optional<double> rim_distance_px(const LampInCam& lamp, const RimRay& ray,
                                                 Eigen::Matrix<double, 1, 6>* jacobian = nullptr);

}  // namespace occ
