// SPDX-License-Identifier: Apache-2.0
// Gauss-Legendre quadrature with any number of nodes, for integrals over [0, 1].
#pragma once

#include <vector>

namespace occ::internal::core {

struct QuadratureNode {
  double at, weight;
};

/// Exact for polynomials of degree 2 count - 1; nodes ascend, weights sum to 1. count >= 1.
std::vector<QuadratureNode> gauss_legendre(int count);

}  // namespace occ::internal::core
