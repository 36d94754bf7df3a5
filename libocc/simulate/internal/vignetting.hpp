// SPDX-License-Identifier: Apache-2.0
// The lens's transmission as a view of the scene has it.
#pragma once

#include "libocc/scene/internal/vignetting.hpp"
#include "libocc/simulate/internal/view.hpp"

namespace occ::internal::simulate {

/// The transmission where a bound needs it: 1 when the scene leaves vignetting out.
double seen_transmission(const SceneView& view, const Eigen::Vector2d& px);

}  // namespace occ::internal::simulate
