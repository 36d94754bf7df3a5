// SPDX-License-Identifier: Apache-2.0
#include "libocc/landmarks/internal/image_tiles.hpp"

#include <algorithm>

namespace occ::internal::landmarks {
namespace {

struct Span {
  int first, count;
  double low, high;  // of the middle part
};

int rounded_up(int value, int unit) { return (value + unit - 1) / unit * unit; }

std::vector<Span> spans(int size, int tile_px, int overlap_px, int unit) {
  const int overlap = rounded_up(overlap_px, unit);
  const int tile = std::max(rounded_up(tile_px, unit), 2 * overlap + unit);
  std::vector<Span> all;
  for (int first = 0;; first += tile - overlap) {
    const bool last = first + tile >= size;
    const int count = last ? size - first : tile;
    const double low = first == 0 ? -1 : first + 0.5 * overlap;
    const double high = last ? size : first + tile - 0.5 * overlap;
    all.push_back({first, count, low, high});
    if (last) return all;
  }
}

}  // namespace

std::vector<ImageTile> image_tiles(int width, int height, int tile_px, int overlap_px, int unit) {
  std::vector<ImageTile> tiles;
  for (const Span& row : spans(height, tile_px, overlap_px, unit))
    for (const Span& column : spans(width, tile_px, overlap_px, unit))
      tiles.push_back({column.first, row.first, column.count, row.count,
                       Eigen::Vector2d(column.low, row.low),
                       Eigen::Vector2d(column.high, row.high)});
  return tiles;
}

}  // namespace occ::internal::landmarks
