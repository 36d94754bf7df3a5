// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/dense_types.hpp"

namespace occ::internal::core {

template <class Matrix>
Eigen::SelfAdjointEigenSolver<Matrix> symmetric_eigen(const Matrix& a, int options) {
  return Eigen::SelfAdjointEigenSolver<Matrix>(a, options);
}

Eigen::Vector2d symmetric_eigenvalues(const Eigen::Matrix2d& a) {
  const double mean = 0.5 * (a(0, 0) + a(1, 1));
  const double half_difference = std::hypot(0.5 * (a(0, 0) - a(1, 1)), a(1, 0));
  return {mean - half_difference, mean + half_difference};
}

template <class Matrix>
Eigen::JacobiSVD<Matrix> jacobi_svd(const Matrix& a, unsigned options) {
  return Eigen::JacobiSVD<Matrix>(a, options);
}

Eigen::MatrixXd minimum_norm_solution(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return Eigen::JacobiSVD<Eigen::MatrixXd>(a, Eigen::ComputeThinU | Eigen::ComputeThinV).solve(b);
}

template Eigen::SelfAdjointEigenSolver<Square<3>> symmetric_eigen(const Square<3>&, int);
template Eigen::SelfAdjointEigenSolver<Square<6>> symmetric_eigen(const Square<6>&, int);
template Eigen::SelfAdjointEigenSolver<Square<8>> symmetric_eigen(const Square<8>&, int);
template Eigen::SelfAdjointEigenSolver<MatrixXd> symmetric_eigen(const MatrixXd&, int);

template Eigen::JacobiSVD<Square<3>> jacobi_svd(const Square<3>&, unsigned);
template Eigen::JacobiSVD<MatrixXd> jacobi_svd(const MatrixXd&, unsigned);

}  // namespace occ::internal::core
