// SPDX-License-Identifier: Apache-2.0
// Internal: lamps of several bright parts, such as two tubes, the cells of a louvre, or a frame of
// light around a dark panel. Parts of similar size and brightness whose gaps are small compared
// with them are joined. The outline of such a lamp is the convex hull of its parts; its rim is not
// measured, because bars and gaps interrupt it.
#pragma once

#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/linear_image.hpp"

namespace occ::internal::detect {

/// Replaces the blobs that are parts of one lamp by one blob (Blob::patterned), and measures a
/// single part with gaps anew. `blobs`: of these components, in their order.
void join_parts(const LinearImage& image, const DetectOptions& options,
                const std::vector<Component>& components, std::vector<Blob>& blobs);

}  // namespace occ::internal::detect
