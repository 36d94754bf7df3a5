// SPDX-License-Identifier: Apache-2.0
// Boxes hide lamps.
#pragma once

#include <optional>

#include "libocc/formation/contour.hpp"
#include "libocc/formation/shadow.hpp"
#include "libocc/formation/sharp_coverage.hpp"

namespace occ {

/// Rim, or the chords of its image, of what is visible of a face; nothing as in rim_contour.
std::optional<RimContour> visible_rim(const Lamp& lamp, const Visible& visible,
                                      const Rigid3& cam_from_world, const Camera& camera,
                                      double spacing_px);
std::optional<Chords> visible_chords(const Lamp& lamp, const Visible& visible,
                                     const Rigid3& cam_from_world, const Camera& camera);

}  // namespace occ
