// SPDX-License-Identifier: Apache-2.0
// Geometry of one lamp from its image alone. The rim of a disc is the cone b^T Q b = 0 of its rays.
// With the eigenvalues l1 >= l2 > 0 > l3 of Q and its eigenvectors V, a disc of radius 1 has the
// normal and the centre
//
//     n = V (s p, 0, q),  C = z0 V (s (l3 / l2) p, 0, (l1 / l2) q),  s = +1 or -1,
//     p^2 = (l1 - l2) / (l1 - l3),  q^2 = (l2 - l3) / (l1 - l3),  z0 = l2 / sqrt(-l1 l3)
//
// (Chen, Wu, Wada, "Camera calibration with two arbitrary coplanar circles", ECCV 2004, eqs (13),
// (14)). The four corners of a rectangle with the bearings b_k and the distances d_k satisfy
//
//     d_0 b_0 - d_1 b_1 + d_2 b_2 - d_3 b_3 = 0,
//
// which determines the distances up to one factor.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ::internal::survey {

/// A lamp in one picture. The unit of length is the lamp's size: the radius of a disc, or the
/// radius of the disc with the area of a rectangle.
struct LampShapeView {
  int blob = 0;                                        ///< index in the picture
  int tag = -1;                                        ///< number of a tag; -1: a lamp
  LampShape shape = LampShape::disc;                   ///< disc or rectangle
  Eigen::Vector3d bearing = Eigen::Vector3d::UnitZ();  ///< direction of the centre; camera frame
  double range = 0;                                    ///< distance of the centre over the size
  double range_sigma = 0;                              ///< relative standard deviation of range
  double angle_sigma_rad = 0;                          ///< standard deviation of the bearing
  std::vector<Eigen::Vector3d> normals;                ///< camera frame; two for a disc
  double tilt_sigma_rad = 0;                           ///< normal of a tag
  Eigen::Vector3d x_axis = Eigen::Vector3d::UnitX();   ///< first side of a rectangle
  Eigen::Vector2d sides = Eigen::Vector2d::Zero();     ///< sides of a rectangle over the size
};

/// Nothing for a blob without a measured rim, that the image border cuts, that shows several lamps,
/// or outside the camera's domain.
std::optional<LampShapeView> lamp_view(const Blob& blob, int index, const Camera& camera);

/// Reason why lamp_view() returns nothing for a blob; empty if the blob has a view.
const char* reason_without_view(const Blob& blob);

/// The direction with the most others within 0.2 rad, averaged over these; of those with nearly as
/// many, the one nearest to the hint, if it is not zero. Zero without directions.
Eigen::Vector3d consensus_direction(const std::vector<Eigen::Vector3d>& directions,
                                    const Eigen::Vector3d& hint = Eigen::Vector3d::Zero());
/// consensus_direction() of the normals of all views.
Eigen::Vector3d common_normal(const std::vector<LampShapeView>& views);

/// Normal of the plane of camera and lamps if these are on a line, within `max_width` over the
/// length of their spread.
std::optional<Eigen::Vector3d> line_normal(const std::vector<Eigen::Vector3d>& bearings,
                                           double max_width);

}  // namespace occ::internal::survey
