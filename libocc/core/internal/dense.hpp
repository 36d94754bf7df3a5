// SPDX-License-Identifier: Apache-2.0
// Decompositions of dense matrices by Eigen, compiled once. An instance of one takes up to four
// seconds to compile, so the functions are templates that dense_factors.cpp and dense_solve.cpp
// instantiate: a type that is not in their lists is an error of the linker.
#pragma once

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "libocc/core/abi.hpp"

namespace occ::internal::core {

/// A^-1 b of a symmetric semidefinite matrix, by the factorisation L D L^T with pivoting.
template <class Matrix, class Right>
Right solve_ldlt(const Matrix& a, const Right& b);

/// A^-1 b of a positive definite matrix, by the factorisation L L^T.
template <class Matrix, class Right>
Right solve_llt(const Matrix& a, const Right& b);

/// True if a symmetric matrix is positive definite (L L^T exists).
template <class Matrix>
bool is_positive_definite(const Matrix& a);

/// Eigenvalues in ascending order, and eigenvectors, of a symmetric matrix (its lower triangle is
/// read).
template <class Matrix>
Eigen::SelfAdjointEigenSolver<Matrix> symmetric_eigen(const Matrix& a,
                                                      int options = Eigen::ComputeEigenvectors);

/// Eigenvalues of a symmetric 2 x 2 matrix, in ascending order: mean of the diagonal, plus or minus
/// the root of ((a - d) / 2)^2 + b^2.
Eigen::Vector2d symmetric_eigenvalues(const Eigen::Matrix2d& a);

/// Singular values in descending order, and the vectors that `options` of Eigen::JacobiSVD asks
/// for.
template <class Matrix>
Eigen::JacobiSVD<Matrix> jacobi_svd(const Matrix& a, unsigned options = 0);

/// The first `columns` columns of the orthogonal factor of A = Q R (Householder).
Eigen::MatrixXd householder_q(const Eigen::MatrixXd& a, Eigen::Index columns);

}  // namespace occ::internal::core
