// SPDX-License-Identifier: Apache-2.0
// Path-following controllers: the command of a vehicle on a route. Both controllers are stateless;
// the distance travelled along the route is an input and an output.
//
// Regulated pure pursuit: an arc to the point of the route at the look-ahead distance L,
//
//   curvature = 2 y / L^2,   y: offset of that point to the vehicle's left,   L = speed lookahead_s
//
// Beyond the paper, L is increased when the vehicle is off the route or oblique to it, because
// short arcs would need turns that the vehicle executes too late, which causes a lasting
// oscillation. Speed is reduced in proportion to the radius in curves sharper than `slow_radius_m`,
// and towards the end.
//   Macenski, Singh, Martin, Gines, "Regulated pure pursuit for robot path tracking", Autonomous
//   Robots 47, 2023, sec. 3 (without its slowing near obstacles).
//
// Stanley: steering along the route and towards it,
//
//   steering = heading error + atan(gain e / (soft_m_s + speed)) + yaw_damping_s (turn rate error)
//
// with e the offset of the guide point to the right of the route. In the paper the guide point is
// the front axle; here it may be anywhere between the origin and the front axle. The steering of a
// front-axle guide point on a curve is added for the remaining distance:
// atan((wheelbase - guide_point_m) curvature). A differential drive is steered like a bicycle with
// the wheelbase `virtual_wheelbase_m`.
//   Hoffmann, Tomlin, Montemerlo, Thrun, "Autonomous automobile trajectory tracking for off-road
//   driving", ACC 2007, eq. (5), without its terms for tyre slip and servo lag.
#pragma once

#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/guide/route.hpp"
#include "libocc/guide/vehicle.hpp"

namespace occ {

/// Speed profile, for both controllers.
struct LIBOCC_API PaceOptions {
  double braking = 0.7;         ///< share of the vehicle's acceleration used for braking
  double slow_radius_m = 0;     ///< radius below which the speed is reduced
  double min_speed_m_s = 0.02;  ///< at the end and in the sharpest curve
  double end_speed_m_s = 0;     ///< at the route's end

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Options of pure_pursuit().
struct LIBOCC_API PurePursuitOptions {
  double lookahead_s = 0.2;                             ///< look-ahead distance over speed
  double min_lookahead_m = 0.1, max_lookahead_m = 0.6;  ///< limits of the look-ahead distance
  double turn_on_spot_rad = 0.8;  ///< differential drive: heading error above which it turns on the
                                  ///< spot first; infinity: never
  PaceOptions pace;               ///< speed in curves and at the end

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Options of stanley().
struct LIBOCC_API StanleyOptions {
  double gain_1_s = 1;       ///< gain of the offset from the route [1/s]
  double soft_m_s = 0.05;    ///< softens the steering at low speed
  double yaw_damping_s = 0;  ///< gain of the turn rate's error; 0: none
  /// Time by which the curvature is previewed; default: half of the time that the vehicle needs to
  /// change its curvature.
  std::optional<double> preview_s;
  double guide_point_m =
      0;  ///< distance ahead of the origin; the wheelbase gives the published law
  double virtual_wheelbase_m = 0.15;  ///< differential drive: wheelbase of the equivalent bicycle
  double turn_on_spot_rad = 0.8;      ///< as in PurePursuitOptions
  PaceOptions pace;                   ///< speed in curves and at the end

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// State of the vehicle, as estimated.
struct ControlInput {
  PlanarPose pose;                ///< pose of the vehicle's origin
  double speed_m_s = 0;           ///< negative: backwards
  double turn_rate_rad_s = 0;     ///< rate of the heading
  std::optional<double> along_m;  ///< previous distance along the route; empty: unknown
};

/// Command, and the vehicle's place relative to the route.
struct ControlOutput {
  DriveCommand command;          ///< within the vehicle's limits
  RoutePlace place;              ///< point of the route nearest to the origin
  double heading_error_rad = 0;  ///< route heading minus vehicle heading
  bool speed_limited = false;    ///< the route's speed exceeds the vehicle's limit
  bool curve_limited = false;    ///< the required curvature exceeds the vehicle's limit
  bool at_end = false;           ///< the end of the route is beside the vehicle or behind it
};

/// Throws std::invalid_argument if the vehicle or the options are invalid or the input is not
/// finite.
LIBOCC_API ControlOutput pure_pursuit(const Route& route, const Vehicle& vehicle,
                                      const ControlInput& input,
                                      const PurePursuitOptions& options = {});
/// Command by Stanley's law; throws as pure_pursuit() does.
LIBOCC_API ControlOutput stanley(const Route& route, const Vehicle& vehicle,
                                 const ControlInput& input, const StanleyOptions& options = {});

}  // namespace occ
