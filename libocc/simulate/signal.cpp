// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/signal.hpp"

#include <algorithm>

namespace occ {
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

void Signal::clear() {
  for (const PixelRectangle& part : touched_)
    for (int y = part.y0; y < part.y0 + part.height; ++y)
      std::fill_n(row(y) + part.x0, part.width, 0.0);
  touched_.clear();
  everywhere_ = {};
}

}  // namespace occ
