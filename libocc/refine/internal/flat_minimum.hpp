// SPDX-License-Identifier: Apache-2.0
// Widens the covariance of a minimum that lies in a flat valley of chi2.
//
// First-order covariances assume that chi2 rises by t^2 at t standard deviations. Where two poses
// of three or four lamps approach each other, it rises far less on the way to the other pose and
// beyond it. The least chi2 over all other unknowns is followed along the weakest direction instead
// (profile likelihood; Venzon and Moolgavkar, "A method for computing profile-likelihood-based
// confidence intervals", Applied Statistics 37, 1988).
#pragma once

#include <functional>

#include "libocc/refine/internal/minimise.hpp"

namespace occ::internal::refine {

/// Normal equations at a state; false if it is impossible.
using LineariseAt = std::function<bool(const State&, PoseNormalEquations&)>;

/// True if an arc of the pose's rotation can bend the valley of chi2 by more than its width.
LIBOCC_API bool may_be_flat(const Minimum& minimum);

/// If the valley is flat or bends by more than two standard deviations, lowers the information so
/// that three standard deviations contain the poses, on both sides, at which the profile of chi2
/// has risen by nine.
LIBOCC_API void widen_if_flat(const LineariseAt& linearise, Minimum& minimum);
LIBOCC_API void widen_if_flat(RefineProblem& problem, Minimum& minimum);

}  // namespace occ::internal::refine
