// SPDX-License-Identifier: Apache-2.0
// Check of a controller's output against the limits of the vehicle.
#pragma once

#include "libocc/guide/vehicle.hpp"

namespace occ::internal::guide {

/// True if curve_command() has to change the speed or the curvature.
bool curve_is_limited(const Vehicle& vehicle, double speed_m_s, double curvature_1_m);

}  // namespace occ::internal::guide
