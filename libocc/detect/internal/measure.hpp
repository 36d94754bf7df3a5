// SPDX-License-Identifier: Apache-2.0
// Internal: measures components with sub-pixel accuracy and returns them as blobs.
//
// A rolling shutter exposes the rows one after the other. A blinking lamp therefore appears as a
// stack of stripes, often with dark gaps between them. The stripes of one lamp are joined, its
// blink frequency is estimated, and its centre is measured without the bias that the phase of the
// stripes causes in a plain centroid.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

/// Measures a component without stripes. `scratch`: storage that is reused from blob to blob.
Blob measure(const LinearImage& image, const Component& component, const DetectOptions& options,
             Patch& scratch);

/// Threshold of a component [grey levels, as stored].
double threshold_dn(const Component& component, const DetectOptions& options);

/// False for a component that is too large for a patch.
bool is_measurable(const Component& component);

/// Ellipse of uniform brightness with these second moments (semi-axes: two standard deviations).
Ellipse ellipse_of(const Eigen::Vector2d& centre, const Eigen::Matrix2d& moments);

/// Inflates the covariance to a quarter of the blob's size, for a blob that is not one whole lamp.
void inflate_covariance(Blob& blob);

/// True if the options request stripes and the sensor has a row time.
bool stripes_enabled(const DetectOptions& options);

/// Returns the blobs of all striped lamps, completely measured (centre, covariance, ellipse, rim of
/// a disc, flux, frequency, flags). Removes their components, and the dim stripes of the halo
/// around them, from `components`; all others are unchanged. Requires stripes_enabled(options).
std::vector<Blob> take_striped_lamps(const LinearImage& image, const DetectOptions& options,
                                     std::vector<Component>& components);

}  // namespace occ::internal::detect
