// SPDX-License-Identifier: Apache-2.0
// Internal: a first look at a blob's outline, good to a tenth of a pixel or so: where rows and
// columns first rise through a level, seen from outside, and the ellipse through these points.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/detect/internal/component.hpp"
#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

struct Outline {
  FittedConic conic;
  bool merged = false;  ///< far from an ellipse
};

/// Mean signal weighted by signal: near the plateau of anything that has one.
double typical_signal(const Patch& patch, const Component& component);

/// Crossings of the signal `level` around the component's box, by linear interpolation: a column's
/// where the outline's normal (the image's gradient) is rather vertical, a row's where it is rather
/// horizontal. Sigma is 1 for all.
std::vector<RimPoint> scan_outline(const Patch& patch, const Component& component, double level);

/// The ellipse of these crossings; nothing when they determine none.
std::optional<Outline> find_outline(const Patch& patch, const Component& component, double level);

}  // namespace occ::internal::detect
