// SPDX-License-Identifier: Apache-2.0
// The last metre: to a pose, not to a place. Far away the smooth law of Park and Kuipers leads to
// the dock's axis,
//
//   curvature = -(k2 (delta - atan(-k1 theta)) + (1 + k1 / (1 + (k1 theta)^2)) sin(delta)) / r
//   speed     = approach_speed_m_s / (1 + beta |curvature|^lambda)
//
// r: distance, theta: the dock's heading, delta: the vehicle's, both from the line of sight
//   (Park, Kuipers, "A smooth control law for graceful motion of differential wheeled mobile robots
//   in 2D environment", ICRA 2011, eqs (14) and (15)),
// then the vehicle creeps along that axis, y its place to the left of it and psi its heading,
//
//   curvature = -2 psi / track_length_m - y / track_length_m^2        (critically damped in length)
//
// ever slower, until it is there; a differential drive then turns the rest on the spot. A vehicle
// that would come to the dock too far aside backs out and tries again.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/guide/vehicle.hpp"

namespace occ {

enum class DockPhase {
  approach,
  creep,
  align,    ///< turns on the spot
  retreat,  ///< backs out, for another try
  docked,
};

/// The enumerator's name.
LIBOCC_API const char* to_string(DockPhase phase);

struct LIBOCC_API DockOptions {
  double k1 = 1, k2 = 3, beta = 0.4, lambda = 2;
  double approach_speed_m_s = 0.3;
  double creep_distance_m = 0.3;  ///< before the dock; backing out goes three times as far
  double creep_speed_m_s = 0.08;
  double slowing_1_s = 1;  ///< creeps no faster than this times what is left
  double min_speed_m_s = 0.01;
  double track_length_m = 0.06;
  double max_aside_m = 0.05;  ///< when creeping begins; beyond, the vehicle backs out
  double tolerance_m = 2e-4;  ///< along the axis
  double tolerance_rad = 2e-4;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct DockOutput {
  DriveCommand command;
  DockPhase phase = DockPhase::approach;  ///< goes into the next call
  PlanarPose in_dock;                     ///< the vehicle's pose in the dock's frame
  bool speed_limited = false;             ///< more was asked than the vehicle can do
  bool curve_limited = false;
};

/// Throws std::invalid_argument when vehicle or options do not validate, or a pose or the speed is
/// not finite.
LIBOCC_API DockOutput dock(const PlanarPose& pose, double speed_m_s, const PlanarPose& target,
                           const Vehicle& vehicle, DockPhase phase,
                           const DockOptions& options = {});

}  // namespace occ
