// SPDX-License-Identifier: Apache-2.0
// Boxes hide lamps.
#pragma once

#include <optional>

#include "libocc/formation/contour.hpp"
#include "libocc/formation/sharp_coverage.hpp"
#include "libocc/simulate/internal/shadow.hpp"

namespace occ {

/// What of a lamp's face is not hidden.
struct Visible {
  double share = 1;             ///< of its area; of a point lamp 0 or 1
  std::vector<Polygon> pieces;  ///< of the face; empty when all or nothing is seen
};

Visible visible_part(const Lamp& lamp, const std::vector<Box>& boxes,
                     const Eigen::Vector3d& seen_from);

/// Rim, or the chords of its image, of what is visible of a face; nothing as in rim_contour.
std::optional<RimContour> visible_rim(const Lamp& lamp, const Visible& visible,
                                      const Rigid3& cam_from_world, const Camera& camera,
                                      double spacing_px);
std::optional<Chords> visible_chords(const Lamp& lamp, const Visible& visible,
                                     const Rigid3& cam_from_world, const Camera& camera);

}  // namespace occ
