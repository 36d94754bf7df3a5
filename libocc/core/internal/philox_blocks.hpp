// SPDX-License-Identifier: Apache-2.0
// Computes many Philox blocks at once, with the same numbers as philox().
#pragma once

#include <array>
#include <cstdint>

#include "libocc/core/simd.hpp"

namespace occ::internal::core {

/// Writes the blocks of the counters {first[i], c[0], c[1], c[2]} under `key`, four words each, for
/// 0 <= i < count. `first` and `words` must have space for `count` rounded up to a multiple of
/// philox_batch; words beyond 4 count are undefined.
constexpr std::uint32_t philox_batch = 32;
void philox_blocks(Simd simd, const std::uint32_t* first, std::uint32_t count,
                   const std::array<std::uint32_t, 3>& c, const std::array<std::uint32_t, 2>& key,
                   std::uint32_t* words);

}  // namespace occ::internal::core
