// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::locate {

/// The options with what a scene says of its lamps: their shapes and, unless they are given, the
/// sensor and the colours.
LIBOCC_API DetectOptions detect_options_of(const Scene& scene, DetectOptions options);

}  // namespace occ::internal::locate
