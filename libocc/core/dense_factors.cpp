// SPDX-License-Identifier: Apache-2.0
#include <Eigen/QR>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::core {

template <class Matrix>
Eigen::SelfAdjointEigenSolver<Matrix> symmetric_eigen(const Matrix& a, int options) {
  return Eigen::SelfAdjointEigenSolver<Matrix>(a, options);
}

template <class Matrix>
Eigen::JacobiSVD<Matrix> jacobi_svd(const Matrix& a, unsigned options) {
  return Eigen::JacobiSVD<Matrix>(a, options);
}

Eigen::MatrixXd householder_q(const Eigen::MatrixXd& a, Eigen::Index columns) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(a).householderQ() *
         Eigen::MatrixXd::Identity(a.rows(), columns);
}

template <int n>
using Square = Eigen::Matrix<double, n, n>;
using Eigen::MatrixXd;

template Eigen::SelfAdjointEigenSolver<Square<2>> symmetric_eigen(const Square<2>&, int);
template Eigen::SelfAdjointEigenSolver<Square<3>> symmetric_eigen(const Square<3>&, int);
template Eigen::SelfAdjointEigenSolver<Square<6>> symmetric_eigen(const Square<6>&, int);
template Eigen::SelfAdjointEigenSolver<Square<7>> symmetric_eigen(const Square<7>&, int);
template Eigen::SelfAdjointEigenSolver<MatrixXd> symmetric_eigen(const MatrixXd&, int);

template Eigen::JacobiSVD<Square<3>> jacobi_svd(const Square<3>&, unsigned);
template Eigen::JacobiSVD<MatrixXd> jacobi_svd(const MatrixXd&, unsigned);

}  // namespace occ::internal::core
