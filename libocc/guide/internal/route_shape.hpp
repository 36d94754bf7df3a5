// SPDX-License-Identifier: Apache-2.0
// Internal: from way-points to one lap of lines and arcs; begin_m is left to the route.
#pragma once

#include <vector>

#include "libocc/guide/route.hpp"

namespace occ::internal::guide {

std::vector<RoutePiece> rounded_lines(const std::vector<RouteWaypoint>& waypoints,
                                      const RouteOptions& options);

std::vector<RoutePiece> spline_arcs(const std::vector<RouteWaypoint>& waypoints,
                                    const RouteOptions& options);

}  // namespace occ::internal::guide
