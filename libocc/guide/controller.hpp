// SPDX-License-Identifier: Apache-2.0
// What to ask of a vehicle so that it follows a route. Both controllers remember nothing: how far
// the vehicle has come along the route goes in and out.
//
// Regulated pure pursuit: an arc to the place of the route that is a look-ahead L away,
//
//   curvature = 2 y / L^2,   y: how far that place is to the vehicle's left,   L = speed
//   lookahead_s
//
// and, beyond the paper, L longer off the route and across it: short arcs would ask for turns that
// follow too late, to and fro for ever. Slower in curves sharper than `slow_radius_m` (in
// proportion to the radius) and towards the end.
//   Macenski, Singh, Martin, Gines, "Regulated pure pursuit for robot path tracking", Autonomous
//   Robots 47, 2023, sec. 3 (without its slowing near obstacles).
//
// Stanley: the steering turns along the route and towards it,
//
//   steering = heading error + atan(gain e / (soft_m_s + speed)) + yaw_damping_s (turn rate error)
//
// e: how far the guide point is to the right of the route. The guide point may be anywhere between
// the origin and the front axle, where it is in the paper; what the front axle does by itself on a
// curve is added for the rest: atan((wheelbase - guide_point_m) curvature). Of a differential drive
// the steering is that of a bicycle of `virtual_wheelbase_m`.
//   Hoffmann, Tomlin, Montemerlo, Thrun, "Autonomous automobile trajectory tracking for off-road
//   driving", ACC 2007, eq. (5); its terms for tyres that slip and a servo that lags are left out.
#pragma once

#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/guide/route.hpp"
#include "libocc/guide/vehicle.hpp"

namespace occ {

/// How fast, for both.
struct LIBOCC_API PaceOptions {
  double braking = 0.7;         ///< share of the vehicle's acceleration to brake with
  double slow_radius_m = 0;     ///< curves sharper than this are driven slower
  double min_speed_m_s = 0.02;  ///< what is left at the very end, and in the sharpest curve
  double end_speed_m_s = 0;     ///< at the route's end

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct LIBOCC_API PurePursuitOptions {
  double lookahead_s = 0.2;
  double min_lookahead_m = 0.1, max_lookahead_m = 0.6;
  double turn_on_spot_rad = 0.8;  ///< differential drive: turns first when the route leads further
                                  ///< aside than this; infinity: never
  PaceOptions pace;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct LIBOCC_API StanleyOptions {
  double gain_1_s = 1;
  double soft_m_s = 0.05;
  double yaw_damping_s = 0;
  /// The curvature is taken so far ahead; none: half of the time that the vehicle needs to turn in.
  std::optional<double> preview_s;
  double guide_point_m = 0;  ///< ahead of the origin; the wheelbase: as published
  double virtual_wheelbase_m = 0.15;
  double turn_on_spot_rad = 0.8;  ///< as in PurePursuitOptions, of the heading error
  PaceOptions pace;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// What a controller knows of its vehicle.
struct ControlInput {
  PlanarPose pose;
  double speed_m_s = 0;
  double turn_rate_rad_s = 0;
  std::optional<double> along_m;  ///< where it was on the route; none: anywhere
};

struct ControlOutput {
  DriveCommand command;
  RoutePlace place;              ///< the route's nearest place to the origin
  double heading_error_rad = 0;  ///< of the route less the vehicle's
  bool speed_limited = false;    ///< the route asks for more
  bool curve_limited = false;    ///< a sharper curve was needed than the vehicle can drive
  bool at_end = false;           ///< the end of the route is beside it or behind
};

/// These throw std::invalid_argument when vehicle or options do not validate, or the input is not
/// finite.
LIBOCC_API ControlOutput pure_pursuit(const Route& route, const Vehicle& vehicle,
                                      const ControlInput& input,
                                      const PurePursuitOptions& options = {});
LIBOCC_API ControlOutput stanley(const Route& route, const Vehicle& vehicle,
                                 const ControlInput& input, const StanleyOptions& options = {});

}  // namespace occ
