// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::locate {

/// The options for the shapes of a scene's lamps and, unless they are given, its sensor and
/// colours.
LIBOCC_API DetectOptions detect_options_of(const Scene& scene, DetectOptions options);

}  // namespace occ::internal::locate
