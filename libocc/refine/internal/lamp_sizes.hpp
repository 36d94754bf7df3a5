// SPDX-License-Identifier: Apache-2.0
// Internal: whether lamps that geometry alone has named look as large as a pose says. The centres
// of three lamps fit some pose always; then their shapes are the only evidence.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::refine {

/// A sentence about a lamp whose size speaks against the pose; empty when there is none. Lamps
/// named by their codes, saturated ones (they have grown) and those that were left out are not
/// asked.
std::string size_contradiction(const Refined& refined, const std::vector<Blob>& blobs,
                               const Scene& scene);

}  // namespace occ::internal::refine
