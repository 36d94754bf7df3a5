// SPDX-License-Identifier: Apache-2.0
// Levenberg-Marquardt on a RefineProblem, by Ceres' TinySolver.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/problem.hpp"

namespace occ::internal::refine {

struct Minimum {
  State state;
  Eigen::Vector3d pivot;  ///< of the normal equations
  Normal normal;          ///< at the state
  int iterations = 0;
  bool defined = false;    ///< all lamps can be seen from the start
  bool converged = false;  ///< the last step moved no lamp further than the tolerance
};

LIBOCC_API Minimum minimise(RefineProblem& problem, const State& start, int max_iterations,
                            double tolerance_px);

/// The same by plain Gauss-Newton steps from a start that is already close: one linearisation each.
LIBOCC_API Minimum polish(RefineProblem& problem, const State& start, int max_iterations,
                          double tolerance_px);

}  // namespace occ::internal::refine
