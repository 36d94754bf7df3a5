// SPDX-License-Identifier: Apache-2.0
// Decompositions of dense matrices by Eigen, compiled once. An instance of one takes up to four
// seconds to compile, so the functions are templates that the sources dense_*.cpp instantiate: a
// type that is not in their lists is an error of the linker.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <array>
#include <cstddef>

#include "libocc/core/abi.hpp"

namespace occ::internal::core {

/// A^-1 b of a square matrix, by the factorisation P L U.
Eigen::VectorXd solve_lu(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// A^-1, by the factorisation P L U.
template <class Matrix>
Matrix inverse(const Matrix& a);

/// The factorisation P A P^T = L D L^T of a symmetric semidefinite matrix, with pivoting.
template <class Matrix>
class Ldlt {
 public:
  Ldlt() = default;
  explicit Ldlt(const Matrix& a) { compute(a); }
  void compute(const Matrix& a);

  const Eigen::LDLT<Matrix>& factors() const { return ldlt_; }
  /// Estimate of 1 / (condition number of A).
  double rcond() const;
  /// A^-1 b.
  template <class Right>
  Right solve(const Right& b) const;

 private:
  Eigen::LDLT<Matrix> ldlt_;
};

/// A^-1 b of a symmetric semidefinite matrix.
template <class Matrix, class Right>
Right solve_ldlt(const Matrix& a, const Right& b) {
  return Ldlt<Matrix>(a).solve(b);
}

/// The factorisation A = L L^T of a positive definite matrix (its lower triangle is read).
template <class Matrix>
class Cholesky {
 public:
  explicit Cholesky(const Matrix& a);

  bool exists() const { return llt_.info() == Eigen::Success; }
  Matrix lower() const;  ///< L
  /// ln of the determinant of A.
  double log_determinant() const { return 2 * llt_.matrixLLT().diagonal().array().log().sum(); }
  /// Estimate of 1 / (condition number of A).
  double rcond() const;

  /// A^-1 b.
  template <class Right>
  Right solve(const Right& b) const;
  /// L^-1 b.
  template <class Right>
  Right solve_lower(const Right& b) const;

 private:
  Eigen::LLT<Matrix> llt_;
};

/// A^-1 b of a positive definite matrix.
template <class Matrix, class Right>
Right solve_llt(const Matrix& a, const Right& b) {
  return Cholesky<Matrix>(a).solve(b);
}

/// True if a symmetric matrix is positive definite (L L^T exists).
template <class Matrix>
bool is_positive_definite(const Matrix& a) {
  return Cholesky<Matrix>(a).exists();
}

/// Sizes of the three caches [bytes] for which Eigen divides large products into blocks, in all of
/// the library. They are fixed, as the order of the sums depends on them: those of the processor
/// would give other bits on other machines.
LIBOCC_API std::array<std::ptrdiff_t, 3> cache_bytes_of_products();

/// Products of dynamic matrices: A B, A^T B and A B^T. With `out` they allocate nothing.
Eigen::MatrixXd product(const Eigen::Ref<const Eigen::MatrixXd>& a,
                        const Eigen::Ref<const Eigen::MatrixXd>& b);
Eigen::MatrixXd transposed_product(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                   const Eigen::Ref<const Eigen::MatrixXd>& b);
Eigen::MatrixXd product_transposed(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                   const Eigen::Ref<const Eigen::MatrixXd>& b);
void product(const Eigen::Ref<const Eigen::MatrixXd>& a, const Eigen::Ref<const Eigen::MatrixXd>& b,
             Eigen::Ref<Eigen::MatrixXd> out);
void transposed_product(const Eigen::Ref<const Eigen::MatrixXd>& a,
                        const Eigen::Ref<const Eigen::MatrixXd>& b,
                        Eigen::Ref<Eigen::MatrixXd> out);
void product_transposed(const Eigen::Ref<const Eigen::MatrixXd>& a,
                        const Eigen::Ref<const Eigen::MatrixXd>& b,
                        Eigen::Ref<Eigen::MatrixXd> out);

/// Replaces the lower triangle of A = L L^T by L; false if A is not positive definite.
bool cholesky_in_place(Eigen::Ref<Eigen::MatrixXd> a);

/// b = L^-1 b and b = L^-T b with the lower triangle of a matrix.
void solve_lower_in_place(const Eigen::Ref<const Eigen::MatrixXd>& l,
                          Eigen::Ref<Eigen::MatrixXd> b);
void solve_lower_transposed_in_place(const Eigen::Ref<const Eigen::MatrixXd>& l,
                                     Eigen::Ref<Eigen::MatrixXd> b);

/// A^T A.
Eigen::MatrixXd gram_matrix(const Eigen::MatrixXd& a);
/// a = a - W W^T in the lower triangle.
void subtract_square(const Eigen::Ref<const Eigen::MatrixXd>& w, Eigen::MatrixXd& a);

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

/// Least squares solution of A x = b of minimum norm.
Eigen::MatrixXd minimum_norm_solution(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// The factorisation A P = Q R with pivoting.
Eigen::ColPivHouseholderQR<Eigen::MatrixXd> pivoted_qr(const Eigen::MatrixXd& a);

/// Least squares solution of A x = b, by pivoted_qr().
Eigen::VectorXd solve_pivoted_qr(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);

/// The factorisation A = Q R of a matrix with independent columns (Householder).
class OrthogonalFactors {
 public:
  explicit OrthogonalFactors(const Eigen::MatrixXd& a);
  /// Least squares solution of A x = b.
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const;

 private:
  Eigen::HouseholderQR<Eigen::MatrixXd> qr_;
};

/// The first `columns` columns of the orthogonal factor of A = Q R (Householder).
Eigen::MatrixXd householder_q(const Eigen::MatrixXd& a, Eigen::Index columns);

}  // namespace occ::internal::core
