// SPDX-License-Identifier: Apache-2.0
// The sensor: from mean signal electrons of every pixel to the image.
#pragma once

#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/simulate/internal/frame.hpp"

namespace occ {

/// Mean signal electrons of every pixel, row by row, dark current not included.
using Signal = std::vector<double>;

Image expose(const Signal& signal, const Frame& frame);

}  // namespace occ
