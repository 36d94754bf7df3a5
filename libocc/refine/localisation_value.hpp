// SPDX-License-Identifier: Apache-2.0
// Which points of an object localise it well: over many views, how often each point is seen, and by
// how much the Cramer-Rao bound of the pose (refine/bound.hpp) grows without it.
#pragma once

#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/object.hpp"

namespace occ {

struct PointValue {
  double seen = 0;    ///< share of the views in which the camera is in its cone and has it in view
  double needed = 0;  ///< share of the views whose pose is determined with it and not without it
  double growth = 1;  ///< of the pose's sigmas without it: geometric mean over their six directions
                      ///< and over those views that show it and determine the pose without it, too
};

struct LocalisationValue {
  std::vector<PointValue> points;  ///< in the object's order
  double determined = 0;           ///< share of the views that determine the pose
  double sigma_m = 0;    ///< median bound of the camera's position there, root of the trace
  double sigma_rad = 0;  ///< of its rotation
};

/// Views of an object's middle: `directions` of them, even over the sphere, from each distance.
LIBOCC_API std::vector<Rigid3> views_around(const Object& object,
                                            const std::vector<double>& distances_m,
                                            int directions = 100);

/// sigma_px: of each point's pixel coordinates. Throws std::invalid_argument for no views, a view
/// that is not finite and a sigma that is not positive; the object must be valid.
LIBOCC_API LocalisationValue localisation_value(const Object& object, const Camera& camera,
                                                const std::vector<Rigid3>& cam_from_object,
                                                double sigma_px);

}  // namespace occ
