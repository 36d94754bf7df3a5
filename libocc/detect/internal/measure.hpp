// SPDX-License-Identifier: Apache-2.0
// Internal: from a component to a Blob with its sub-pixel measurements.
#pragma once

#include "libocc/core/blob.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/detect/internal/component.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

/// `scratch` keeps its storage from blob to blob.
Blob measure(const LinearImage& image, const Component& component, const DetectOptions& options,
             Patch& scratch);

}  // namespace occ::internal::detect
