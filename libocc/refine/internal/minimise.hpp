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

/// One Gauss-Newton step of the pose and of the shared errors.
LIBOCC_API Minimum step_with_shared_errors(RefineProblem& problem, const State& start,
                                           double tolerance_px);

}  // namespace occ::internal::refine
