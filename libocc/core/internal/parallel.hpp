// SPDX-License-Identifier: Apache-2.0
// Parallel loop over independent indices. Results are the same bits for any number of threads when
// work(i) writes only what belongs to i; sums over indices are formed afterwards, in a fixed order.
#pragma once

#include <cstddef>
#include <functional>

#include "libocc/core/abi.hpp"

namespace occ::internal::core {

/// Number of threads that the machine runs at once, at least 1.
LIBOCC_API int hardware_threads();

/// Calls work(i) once for each i < count, on up to `threads` >= 1 threads including the calling
/// one. Indices are handed out one by one, so that the calls may differ in length. After an
/// exception no further index starts; the first exception is thrown again when all threads have
/// ended.
LIBOCC_API void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work,
                               int threads = hardware_threads());

}  // namespace occ::internal::core
