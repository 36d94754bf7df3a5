// SPDX-License-Identifier: Apache-2.0
// Internal: the same work for many indices, each for itself.
#pragma once

#include <cstddef>
#include <functional>

namespace occ::internal::core {

/// Calls work(i) for all i below `count`, on as many threads as the machine has. What one throws is
/// thrown when all have ended.
void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace occ::internal::core
