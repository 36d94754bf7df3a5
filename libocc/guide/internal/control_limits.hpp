// SPDX-License-Identifier: Apache-2.0
// Internal: what controllers ask of a vehicle that it cannot do.
#pragma once

#include "libocc/guide/vehicle.hpp"

namespace occ::internal::guide {

/// Whether curve_command() had to change what was asked.
bool curve_is_limited(const Vehicle& vehicle, double speed_m_s, double curvature_1_m);

}  // namespace occ::internal::guide
