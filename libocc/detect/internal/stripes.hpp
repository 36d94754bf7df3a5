// SPDX-License-Identifier: Apache-2.0
// Internal: lamps that blink under a rolling shutter. Rows are exposed one after the other, so such
// a lamp shows as a stack of stripes, often with dark gaps between them. Here the stripes of one
// lamp are put together, its blink frequency is read, and its centre is measured without the bias
// that the phase of the stripes gives to a plain centroid.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/detect/internal/component.hpp"
#include "libocc/detect/internal/linear_image.hpp"

namespace occ::internal::detect {

/// Whether the options ask for stripes and the sensor has a row time to read them with.
bool reads_stripes(const DetectOptions& options);

/// The blobs of all striped lamps, finished (centre, covariance, ellipse, rim of a disc, flux,
/// frequency, flags). Their components, and the dim stripes of the halo around them, are taken out
/// of `components`; whatever shows no stripes stays there untouched. Needs reads_stripes(options).
std::vector<Blob> take_striped_lamps(const LinearImage& image, const DetectOptions& options,
                                     std::vector<Component>& components);

}  // namespace occ::internal::detect
