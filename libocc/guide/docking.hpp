// SPDX-License-Identifier: Apache-2.0
// Docking: drives to a pose. Far away, the smooth control law of Park and Kuipers leads to the
// dock's axis,
//
//   curvature = -(k2 (delta - atan(-k1 theta)) + (1 + k1 / (1 + (k1 theta)^2)) sin(delta)) / r
//   speed     = approach_speed_m_s / (1 + beta |curvature|^lambda)
//
// with the distance r, the dock's heading theta and the vehicle's heading delta, both relative to
// the line of sight
//   (Park, Kuipers, "A smooth control law for graceful motion of differential wheeled mobile robots
//   in 2D environment", ICRA 2011, eqs (14) and (15)).
// Then the vehicle creeps along that axis, with its offset y to the left and its heading psi,
//
//   curvature = -2 psi / track_length_m - y / track_length_m^2        (critically damped in length)
//
// and with decreasing speed. A differential drive corrects the remaining heading on the spot. A
// vehicle with a large offset at the dock backs out and tries again.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/guide/vehicle.hpp"

namespace occ {

/// Stages of docking.
enum class DockPhase {
  approach,  ///< drives to the dock's axis
  creep,     ///< drives along the axis, slowly
  align,     ///< turns on the spot
  retreat,   ///< backs out for another attempt
  docked,    ///< within the tolerances: the command is zero
};

/// The enumerator's name.
LIBOCC_API const char* to_string(DockPhase phase);

/// Options of dock().
struct LIBOCC_API DockOptions {
  double k1 = 1, k2 = 3, beta = 0.4, lambda = 2;  ///< constants of the control law above; no unit
  double approach_speed_m_s = 0.3;                ///< maximum speed of the approach
  double creep_distance_m = 0.3;  ///< distance before the dock; backing out goes three times as far
  double creep_speed_m_s = 0.08;  ///< maximum speed on the axis
  double slowing_1_s = 1;         ///< maximum creep speed per remaining distance
  double min_speed_m_s = 0.01;    ///< lower limit of the speed before the dock
  double track_length_m = 0.06;   ///< length constant of the correction on the axis
  double max_aside_m =
      0.05;  ///< maximum offset when creeping begins; beyond it the vehicle backs out
  double tolerance_m = 2e-4;    ///< along the axis
  double tolerance_rad = 2e-4;  ///< error of the heading

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Command, and the next phase.
struct DockOutput {
  DriveCommand command;                   ///< within the vehicle's limits
  DockPhase phase = DockPhase::approach;  ///< input of the next call
  PlanarPose in_dock;                     ///< pose of the vehicle in the dock frame
  bool speed_limited = false;             ///< the required speed exceeds the vehicle's limit
  bool curve_limited = false;             ///< the required curvature exceeds the vehicle's limit
};

/// Computes one control step. Throws std::invalid_argument if the vehicle or the options are
/// invalid, or a pose or the speed is not finite.
LIBOCC_API DockOutput dock(const PlanarPose& pose, double speed_m_s, const PlanarPose& target,
                           const Vehicle& vehicle, DockPhase phase,
                           const DockOptions& options = {});

}  // namespace occ
