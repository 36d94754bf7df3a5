// SPDX-License-Identifier: Apache-2.0
// Checks and square roots of covariance and information matrices.
//
// A matrix A is scaled to C = D^-1 A D^-1 with D^2 = max(diag A, 1e-6 max diag A), so that the
// checks do not depend on the units of its rows. It is symmetric if |C - C^T| <= 1e-6, and positive
// semi-definite if no eigenvalue of C is below -1e-6. Both tolerances admit the rounding errors of
// single precision (6e-8 per operation). The lower limit of D admits errors of 1e-12 of the largest
// diagonal entry, which remain where large terms cancel.
#pragma once

#include <Eigen/Core>
#include <string_view>

#include "libocc/core/abi.hpp"

namespace occ::internal::core {

using Matrix2 = Eigen::Matrix<double, 2, 2>;
using Matrix3 = Eigen::Matrix<double, 3, 3>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

/// Throws std::invalid_argument, with the name and the value, unless the matrix is finite,
/// symmetric and positive semi-definite.
LIBOCC_API void require_semidefinite(const Matrix3& a, std::string_view name);
LIBOCC_API void require_semidefinite(const Matrix6& a, std::string_view name);

/// Throws std::invalid_argument, with the name and the value, unless the matrix is finite,
/// symmetric and positive definite.
LIBOCC_API void require_positive_definite(const Matrix2& a, std::string_view name);
LIBOCC_API void require_positive_definite(const Matrix3& a, std::string_view name);
LIBOCC_API void require_positive_definite(const Matrix6& a, std::string_view name);

/// R with R^T R = A of a positive semi-definite matrix. Negative eigenvalues, which are rounding
/// errors, are treated as zero. R is not triangular if A is singular.
LIBOCC_API Matrix3 semidefinite_root(const Matrix3& a);
LIBOCC_API Matrix6 semidefinite_root(const Matrix6& a);

}  // namespace occ::internal::core
