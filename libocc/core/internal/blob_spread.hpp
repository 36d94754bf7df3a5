// SPDX-License-Identifier: Apache-2.0
// Error of the centroid of a lamp of which only a part is seen.
#pragma once

#include <algorithm>

#include "libocc/core/blob.hpp"

namespace occ::internal::core {

/// Standard deviation of the lamp's centroid about that of the visible part [px].
inline double spread_px(const Blob& blob) {
  return 0.25 * std::max(blob.x1 - blob.x0 + 1, blob.y1 - blob.y0 + 1);
}

}  // namespace occ::internal::core
