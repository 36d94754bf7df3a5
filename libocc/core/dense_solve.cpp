// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::core {

template <class Matrix, class Right>
Right solve_ldlt(const Matrix& a, const Right& b) {
  return a.ldlt().solve(b);
}

template <class Matrix, class Right>
Right solve_llt(const Matrix& a, const Right& b) {
  return a.llt().solve(b);
}

template <class Matrix>
bool is_positive_definite(const Matrix& a) {
  return a.llt().info() == Eigen::Success;
}

template <int n>
using Square = Eigen::Matrix<double, n, n>;
template <int n>
using Vector = Eigen::Matrix<double, n, 1>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

template Vector<3> solve_ldlt(const Square<3>&, const Vector<3>&);
template Vector<5> solve_ldlt(const Square<5>&, const Vector<5>&);
template Vector<10> solve_ldlt(const Square<10>&, const Vector<10>&);
template VectorXd solve_ldlt(const MatrixXd&, const VectorXd&);
template MatrixXd solve_ldlt(const MatrixXd&, const MatrixXd&);
template Eigen::Matrix<double, 5, 2> solve_ldlt(const Square<5>&,
                                                const Eigen::Matrix<double, 5, 2>&);

template Vector<2> solve_llt(const Square<2>&, const Vector<2>&);
template Square<3> solve_llt(const Square<3>&, const Square<3>&);
template Vector<6> solve_llt(const Square<6>&, const Vector<6>&);
template MatrixXd solve_llt(const MatrixXd&, const MatrixXd&);
template Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 14, 1> solve_llt(
    const MatrixXd&, const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 14, 1>&);

template bool is_positive_definite(const Square<2>&);
template bool is_positive_definite(const Square<3>&);
template bool is_positive_definite(const Square<6>&);
template bool is_positive_definite(const MatrixXd&);

}  // namespace occ::internal::core
