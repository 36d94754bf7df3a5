// SPDX-License-Identifier: Apache-2.0
// Boxes hide lamps.
#pragma once

#include <optional>

#include "libocc/formation/contour.hpp"
#include "libocc/formation/internal/shadow.hpp"
#include "libocc/formation/internal/sharp_coverage.hpp"

namespace occ::internal::simulate {

/// Rim, or the chords of its image, of what is visible of a face; nothing as in rim_contour.
std::optional<RimContour> visible_rim(const Lamp& lamp, const formation::Visible& visible,
                                      const Rigid3& cam_from_world, const Camera& camera,
                                      double spacing_px);
std::optional<formation::Chords> visible_chords(const Lamp& lamp, const formation::Visible& visible,
                                                const Rigid3& cam_from_world, const Camera& camera);

}  // namespace occ::internal::simulate
