// SPDX-License-Identifier: Apache-2.0
// Colour filters of the pixels: which part of a light a pixel receives, and its response curve.
#pragma once

#include "libocc/radiometry/internal/mosaic.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

/// Light received through each filter, relative to white light without a filter.
ByPlace light_by_place(const Sensor& sensor, const Eigen::Vector3d& colour);

/// Like above, for an image; 1 if the plan omits the mosaic.
ByPlace light_by_place(const Frame& frame, const Eigen::Vector3d& colour);

/// The sensor with the response curve of the pixels at a place of the mosaic.
Sensor sensor_at(const Sensor& sensor, std::size_t place);

/// Upper limit of a pixel's light relative to a pixel without mosaic and gain.
double max_pixel_factor(const Scene& scene, const Eigen::Vector3d& colour);

}  // namespace occ::internal::simulate
