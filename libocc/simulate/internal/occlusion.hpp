// SPDX-License-Identifier: Apache-2.0
// Boxes hide lamps.
#pragma once

#include <optional>

#include "libocc/formation/contour.hpp"
#include "libocc/simulate/internal/shadow.hpp"

namespace occ {

/// What of a lamp's face is not hidden.
struct Visible {
  double share = 1;             ///< of its area; of a point lamp 0 or 1
  std::vector<Polygon> pieces;  ///< of the face; empty when all or nothing is seen
};

Visible visible_part(const Lamp& lamp, const std::vector<Box>& boxes,
                     const Eigen::Vector3d& seen_from);

/// Contour of the pieces' image; nothing when some of it is outside the camera's domain.
std::optional<Contour> project_pieces(const Lamp& lamp, const std::vector<Polygon>& pieces,
                                      const Rigid3& cam_from_world, const Camera& camera,
                                      double spacing_px);

}  // namespace occ
