// SPDX-License-Identifier: Apache-2.0
// Minimises a RefineProblem: Levenberg-Marquardt (core/internal/least_squares.hpp), then
// Gauss-Newton.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/problem.hpp"

namespace occ::internal::refine {

struct Minimum {
  State state;
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();  ///< pivot of the normal equations
  PoseNormalEquations normal = {};                  ///< at the state
  int iterations = 0;
  bool defined = false;    ///< all lamps are visible from the start
  bool converged = false;  ///< the last step moved no lamp farther than the tolerance
  /// Second-order part of the covariance of a left perturbation, in a flat valley.
  Matrix6 bend = Matrix6::Zero();
  Eigen::VectorXd shared_errors = {};  ///< estimates; empty if there are none
  NormalParts parts = {};              ///< parts of the normal equations
};

LIBOCC_API Minimum minimise(RefineProblem& problem, const State& start, int max_iterations,
                            double tolerance_px);

/// Minimises by Gauss-Newton steps alone, for a close start: one linearisation for each step.
LIBOCC_API Minimum polish(RefineProblem& problem, const State& start, int max_iterations,
                          double tolerance_px);

/// A step of the shared errors and the pose that is shorter, in standard deviations, changes
/// nothing.
inline constexpr double stable_sigmas = 1e-3;

/// One Gauss-Newton step of the pose and of the shared errors. It has converged if it moves no lamp
/// farther than the tolerance, or if the pose is stable.
LIBOCC_API Minimum step_with_shared_errors(RefineProblem& problem, const State& start,
                                           double tolerance_px);

}  // namespace occ::internal::refine
