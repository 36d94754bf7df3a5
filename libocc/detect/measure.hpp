// SPDX-License-Identifier: Apache-2.0
// Internal: from a component to a Blob with its sub-pixel measurements.
#pragma once

#include "libocc/core/blob.hpp"
#include "libocc/detect/component.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/detect/linear_image.hpp"

namespace occ::detecting {

Blob measure(const LinearImage& image, const Component& component, const DetectOptions& options);

/// The blob as its moments have it, without a look at the pixels.
Blob moments_blob(const Component& component);

}  // namespace occ::detecting
