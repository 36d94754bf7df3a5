// SPDX-License-Identifier: Apache-2.0
// Pixels differ in how many electrons they make of the same light: the same from image to image.
#pragma once

#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

/// No pixel's gain is farther from the mean.
constexpr double max_deviations = 6.4;

void apply_gain(const Frame& frame, Signal& signal);

}  // namespace occ::internal::simulate
