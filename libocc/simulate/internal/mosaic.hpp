// SPDX-License-Identifier: Apache-2.0
// Colour filters over the pixels: which light a pixel gets, and by which curve it is stored.
#pragma once

#include "libocc/radiometry/internal/mosaic.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

/// What pixels get of a light, over white light's through no filter.
ByPlace light_by_place(const Sensor& sensor, const Eigen::Vector3d& colour);

/// The sensor as the pixels at a place are.
Sensor sensor_at(const Sensor& sensor, std::size_t place);

/// All that a light may be brighter by, in any pixel, than without mosaic and gain.
double brightest_factor(const Scene& scene, const Eigen::Vector3d& colour);

}  // namespace occ::internal::simulate
