// SPDX-License-Identifier: Apache-2.0
// Likely reasons for a doubtful fix, for its message.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::locate {

/// Names unusual properties of a pose and its blobs, with a remedy: over-exposed lamps, sizes that
/// differ by one factor, residuals that are too large for the errors of the blobs, lamps that were
/// left out, lamps that should be visible and are not. Each begins with "; ", so that it can be
/// appended to a message; empty if nothing is unusual.
LIBOCC_API std::string suspects(const Refined& pose, const std::vector<Blob>& blobs,
                                const Scene& scene);

}  // namespace occ::internal::locate
