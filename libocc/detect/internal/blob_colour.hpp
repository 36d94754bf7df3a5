// SPDX-License-Identifier: Apache-2.0
// Internal: colour of a blob, from the channels of the image around it.
#pragma once

#include <optional>

#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

/// Measures the colour of a component in an image of three or four channels. `linear` is of the
/// same image and converts its channels. `patch` is that of the component, in the image in which it
/// was found, and selects its bright pixels. Empty if the component has no light above its
/// background, or if the patch does not contain it.
std::optional<BlobColour> measure_colour(const ImageView& image, const LinearImage& linear,
                                         const Component& component, const Patch& patch);

}  // namespace occ::internal::detect
