// SPDX-License-Identifier: Apache-2.0
// Internal: from a measured striped lamp to the Blob that stands for it.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/detect/internal/component.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/detect/internal/striped_lamp.hpp"

namespace occ::internal::detect {

/// `columns`: the lamp's lines are image columns; `sum`: of the components that are the lamp's.
Blob striped_blob(const LinearImage& image, const DetectOptions& options, bool columns,
                  const StripedLamp& lamp, const Component& sum);

}  // namespace occ::internal::detect
