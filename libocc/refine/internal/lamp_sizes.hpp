// SPDX-License-Identifier: Apache-2.0
// Compares the measured sizes of lamps with the sizes predicted by a pose. The centres of any three
// lamps fit some pose, so their sizes are the only check of an assignment by geometry.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::refine {

/// Message about a lamp whose size contradicts the pose; empty if there is none. Lamps identified
/// by their codes, saturated lamps (their rims have grown) and lamps that were left out are not
/// tested.
std::string size_contradiction(const Refined& refined, const std::vector<Blob>& blobs,
                               const Scene& scene);

}  // namespace occ::internal::refine
