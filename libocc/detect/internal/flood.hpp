// SPDX-License-Identifier: Apache-2.0
// Internal: pixels that are connected with a start.
#pragma once

#include <array>
#include <cstddef>
#include <utility>
#include <vector>

namespace occ::internal::detect {

/// Columns and rows of pixels, or steps between neighbours.
using Places = std::vector<std::pair<int, int>>;

inline constexpr std::array<std::pair<int, int>, 4> side_steps = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
inline constexpr std::array<std::pair<int, int>, 8> all_steps = {
    {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}}};

/// The start and all pixels that steps lead to. `take(x, y)` is true once for each pixel that
/// belongs to the region; it is not called for the start.
template <std::size_t N, typename Take>
Places flood(std::pair<int, int> start, const std::array<std::pair<int, int>, N>& steps,
             Take&& take) {
  Places region{start};
  for (std::size_t k = 0; k < region.size(); ++k) {
    const auto [x, y] = region[k];
    for (const auto& [dx, dy] : steps)
      if (take(x + dx, y + dy)) region.emplace_back(x + dx, y + dy);
  }
  return region;
}

}  // namespace occ::internal::detect
