// SPDX-License-Identifier: Apache-2.0
// Protection level of a position by solution separation: a bound of the position's error that is
// exceeded, without detection, with at most a stated probability (the integrity risk).
//
// Each lamp may be faulty (moved, misnamed, a reflection) with probability p, by any amount. A
// hypothesis i is a set of faulty lamps. It is monitored by the position from the other lamps, one
// Gauss-Newton step from the solution of all: N - sum H, with the normal equations N and those of
// each lamp H. With the covariances C_0 and C_i of both positions, the covariance of their
// separation is C_i - C_0 (Brown, "A baseline GPS RAIM scheme", Navigation 39(2), 1992; Blanch,
// Walter, Enge et al., "Baseline advanced RAIM user algorithm and possible improvements", IEEE
// Trans. AES 51(1), 2015). The separation must be below the threshold T_i. The levels solve, as the
// protection levels of Blanch et al. without nominal biases,
//
//     vertical:    2 Q(V / s_0) + sum p_i Q((V - T_i) / s_i) + u = risk,
//     horizontal:  E(H / s_0) + sum p_i E((H - T_i) / s_i) + u = risk,
//
// with Q the tail of the normal distribution and u the probability of what is not monitored. The
// horizontal error is a vector: s is the largest standard deviation along any horizontal direction,
// and E(x) = exp(-x^2 / 2) for x > 0, else 1, bounds the probability that its length exceeds x s
// (exact for equal axes, 7 % too long at 1e-7 for one axis).
//
// Covariances contain the variance factor and the errors of the map that were estimated. Their
// second-order part is scaled by the square of the variance. Of more than 12 lamps, 12 groups are
// the units that are faulty, because each set of lamps is part of a set of groups.
//
// u is the sum of the hypotheses whose other lamps do not determine the pose, of those with more
// faults than are monitored, and of Fix::risk. Sets of one and two lamps are monitored, and larger
// ones until those left have at most half of the risk. If u reaches the risk, the level is
// infinite.
//
// If lamps were excluded, the level is that of the others. Half of the risk (less that of more
// faults than are monitored and of Fix::risk, which counts once) belongs to fixes without an
// excluded lamp, the other half is divided among all sets of as many lamps.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"

namespace occ {

/// Normal equations of one lamp: the sums J^T J and J^T r of its whitened residuals.
struct LampEquations {
  int lamp = 0;                 ///< Refined: index in the scene; Fix: id
  Eigen::MatrixXd information;  ///< J^T J
  Eigen::VectorXd gradient;     ///< J^T r
};

/// Linearised position of a refined pose, with the contribution of each lamp. The unknowns are
/// those of the pose and those common to the lamps, such as errors of the camera.
struct SeparationModel {
  std::vector<LampEquations> lamps;   ///< lamps in use
  Eigen::MatrixXd prior_information;  ///< priors have no fault
  Eigen::MatrixXd position_jacobian;  ///< d position (3, world) / d unknowns
  double variance_factor = 1;         ///< contained in the covariance of the pose
  /// Covariance of the position. It exceeds that of the unknowns by second-order effects.
  Eigen::Matrix3d position_covariance_m2 = Eigen::Matrix3d::Zero();
  int excluded = 0;  ///< number of lamps that were left out as gross errors
  /// Probability that a lamp is faulty in an image (LocateOptions::lamp_fault_probability).
  double fault_probability = 1e-3;
};

/// Bound of the error of a position.
struct ProtectionLevel {
  double risk = 0;  ///< probability that an error beyond the level is not detected
  /// Horizontal and vertical (world z) level; infinite if the status is not ok.
  double horizontal_m = std::numeric_limits<double>::infinity();
  double vertical_m = std::numeric_limits<double>::infinity();  ///< see horizontal_m
  double unmonitored = 0;                                       ///< u of the equation above
  int hypotheses = 0;  ///< number of monitored sets of faulty lamps
  /// Set of lamps with the largest separation beyond its threshold; empty if all are below.
  std::vector<int> contradicting_lamps;
};

/// `assignment_risk`: Fix::risk. `continuity_risk`: probability that a separation exceeds its
/// threshold in an image without faults. Status: ok; too_few_lamps (`unmonitored` reaches the
/// risk); no_pose (a separation exceeds its threshold). Throws std::invalid_argument for a
/// probability that is not between 0 and 1.
LIBOCC_API Result<ProtectionLevel> protection_level(const SeparationModel& model, double risk,
                                                    double continuity_risk = 1e-3,
                                                    double assignment_risk = 0);

/// Lamps whose separation exceeds its threshold when one lamp at a time is left out, the largest
/// excess first.
LIBOCC_API std::vector<int> separated_lamps(const SeparationModel& model,
                                            double continuity_risk = 1e-3);

}  // namespace occ
