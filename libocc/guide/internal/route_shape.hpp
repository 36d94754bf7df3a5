// SPDX-License-Identifier: Apache-2.0
// Converts way-points to one lap of lines and arcs. The caller sets begin_m.
#pragma once

#include <vector>

#include "libocc/guide/route.hpp"

namespace occ::internal::guide {

std::vector<RoutePiece> rounded_lines(const std::vector<RouteWaypoint>& waypoints,
                                      const RouteOptions& options);

std::vector<RoutePiece> spline_arcs(const std::vector<RouteWaypoint>& waypoints,
                                    const RouteOptions& options);

}  // namespace occ::internal::guide
