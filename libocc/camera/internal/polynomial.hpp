// SPDX-License-Identifier: Apache-2.0
// Polynomials as coefficients, constant first.
#pragma once

#include <vector>

namespace occ::internal::camera {

using Polynomial = std::vector<double>;

double evaluate(const Polynomial& p, double x);
Polynomial derivative(const Polynomial& p);
Polynomial product(const Polynomial& p, const Polynomial& q);
Polynomial sum(const Polynomial& p, double factor, const Polynomial& q);  ///< p + factor q

/// Where p changes its sign in (0, limit), ascending. Between neighbouring roots of its derivative
/// a polynomial is monotone, so bisection finds every one.
std::vector<double> sign_changes(const Polynomial& p, double limit);

}  // namespace occ::internal::camera
