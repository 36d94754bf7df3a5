// SPDX-License-Identifier: Apache-2.0
// Newton's method with the second derivatives of the residuals, for minima where Gauss-Newton
// fails.
//
// Near the danger cylinder of three lamps, noise can leave no pose that fits their centroids. There
// the Jacobian is nearly singular along the direction in which two poses meet, but the residuals
// are not zero: the curvature of chi2 is that of the residuals, which J^T J does not contain.
#pragma once

#include "libocc/refine/internal/minimise.hpp"

namespace occ::internal::refine {

/// Continues from `minimum`. When it converges, `normal.information` is half the Hessian of chi2.
LIBOCC_API void run_newton(RefineProblem& problem, int max_iterations, double tolerance_px,
                           Minimum& minimum);

}  // namespace occ::internal::refine
