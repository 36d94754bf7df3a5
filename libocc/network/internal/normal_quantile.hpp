// SPDX-License-Identifier: Apache-2.0
// Probabilities of the normal distribution and of Student's, for tests of single residuals.
#pragma once

namespace occ::internal::network {

double normal_probability(double z);  ///< of a value below z
/// z with normal_probability(z) == p, by Newton's steps from Hastings' approximation; 0 < p < 1.
double normal_quantile(double p);
double student_quantile(double p, int dof);  ///< by bisection of the incomplete beta function

}  // namespace occ::internal::network
