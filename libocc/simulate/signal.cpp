// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/signal.hpp"

#include <algorithm>

namespace occ::internal::simulate {
namespace {

bool contains(const PixelRectangle& outer, const PixelRectangle& inner) {
  return outer.x0 <= inner.x0 && outer.y0 <= inner.y0 &&
         outer.x0 + outer.width >= inner.x0 + inner.width &&
         outer.y0 + outer.height >= inner.y0 + inner.height;
}

}  // namespace

void Signal::touch(const PixelRectangle& rectangle) {
  for (const PixelRectangle& known : touched_)
    if (contains(known, rectangle)) return;
  const auto covered = [&](const PixelRectangle& known) { return contains(rectangle, known); };
  touched_.erase(std::remove_if(touched_.begin(), touched_.end(), covered), touched_.end());
  touched_.push_back(rectangle);
}

std::vector<Signal::Run> Signal::runs(int y) const {
  std::vector<Run> all;
  for (const PixelRectangle& part : touched_)
    if (y >= part.y0 && y < part.y0 + part.height) all.push_back({part.x0, part.x0 + part.width});
  std::sort(all.begin(), all.end(), [](const Run& a, const Run& b) { return a.begin < b.begin; });
  std::vector<Run> merged;
  for (const Run& run : all) {
    if (merged.empty() || run.begin > merged.back().end)
      merged.push_back(run);
    else
      merged.back().end = std::max(merged.back().end, run.end);
  }
  return merged;
}

void Signal::move_everywhere_to_rows() {
  if (everywhere_ == ByPlace{}) return;
  touch_everything();
  for (int y = 0; y < height_; ++y) {
    double* to = row(y);
    for (int x = 0; x < width_; ++x) to[x] += everywhere_[place_of(x, y)];
  }
  everywhere_ = {};
}

void Signal::clear() {
  for (const PixelRectangle& part : touched_)
    for (int y = part.y0; y < part.y0 + part.height; ++y)
      std::fill_n(row(y) + part.x0, part.width, 0.0);
  touched_.clear();
  everywhere_ = {};
}

}  // namespace occ::internal::simulate
