// SPDX-License-Identifier: Apache-2.0
// Contribution of each point of an object to its localisation, over many views: how often the point
// is visible, and by how much the Cramer-Rao bound of the pose (refine/bound.hpp) grows without it.
#pragma once

#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/object.hpp"

namespace occ {

/// Contribution of one point.
struct PointValue {
  double seen = 0;    ///< share of the views that have it in view, with the camera in its cone
  double needed = 0;  ///< share of the views whose pose is determined with it but not without it
  /// Growth of the pose's sigmas without it: geometric mean over the six directions, and over the
  /// views that show it and determine the pose without it as well.
  double growth = 1;
};

/// Contributions of all points of an object.
struct LocalisationValue {
  std::vector<PointValue> points;  ///< in the object's order
  double determined = 0;           ///< share of the views that determine the pose
  double sigma_m = 0;    ///< median over these of the bound of the position: root of the trace
  double sigma_rad = 0;  ///< median bound of the rotation
};

/// Poses (camera from object) of cameras that look at the object's middle: from each distance,
/// `directions` evenly over the sphere.
LIBOCC_API std::vector<Rigid3> views_around(const Object& object,
                                            const std::vector<double>& distances_m,
                                            int directions = 100);

/// `sigma_px`: standard deviation of each pixel coordinate. The object must be valid. Throws
/// std::invalid_argument without views, for a view that is not finite, and for a sigma that is not
/// positive.
LIBOCC_API LocalisationValue localisation_value(const Object& object, const Camera& camera,
                                                const std::vector<Rigid3>& cam_from_object,
                                                double sigma_px);

}  // namespace occ
