// SPDX-License-Identifier: Apache-2.0
// The plan of one image, and whether it depends on the pose.
#pragma once

#include <algorithm>

#include "libocc/simulate/internal/view.hpp"
#include "libocc/simulate/plan.hpp"

namespace occ::internal::simulate {

/// An effect that there is none of without the one that it follows from.
struct Consequence {
  Effect cause, effect;
};
constexpr Consequence consequences[] = {{Effect::walls, Effect::interreflection},
                                        {Effect::saturation, Effect::blooming}};

/// Without a view there are no bounds; it is needed where the use of an effect depends on them.
RenderPlan make_plan(const Scene& scene, const SimulateOptions& options, const SceneView* view);

inline bool depends_on_bounds(const Effects& effects) {
  return std::find(effects.use.begin(), effects.use.end(), Use::automatic) != effects.use.end();
}

}  // namespace occ::internal::simulate
