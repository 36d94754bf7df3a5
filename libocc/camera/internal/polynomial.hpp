// SPDX-License-Identifier: Apache-2.0
// Polynomials as coefficients, constant term first.
#pragma once

#include <vector>

namespace occ::internal::camera {

using Polynomial = std::vector<double>;

double evaluate(const Polynomial& p, double x);
Polynomial derivative(const Polynomial& p);
Polynomial product(const Polynomial& p, const Polynomial& q);
Polynomial sum(const Polynomial& p, double factor, const Polynomial& q);  ///< p + factor q

/// Positions in (0, limit) where p changes its sign, ascending. Between neighbouring roots of its
/// derivative a polynomial is monotone, so bisection finds all of them.
std::vector<double> sign_changes(const Polynomial& p, double limit);

}  // namespace occ::internal::camera
