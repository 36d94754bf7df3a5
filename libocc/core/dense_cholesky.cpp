// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/dense_types.hpp"

namespace occ::internal::core {

template <class Matrix>
Cholesky<Matrix>::Cholesky(const Matrix& a) : llt_(a) {}

template <class Matrix>
Matrix Cholesky<Matrix>::lower() const {
  return llt_.matrixL();
}

template <class Matrix>
double Cholesky<Matrix>::rcond() const {
  return llt_.rcond();
}

template <class Matrix>
template <class Right>
Right Cholesky<Matrix>::solve(const Right& b) const {
  return llt_.solve(b);
}

template <class Matrix>
template <class Right>
Right Cholesky<Matrix>::solve_lower(const Right& b) const {
  return llt_.matrixL().solve(b);
}

bool cholesky_in_place(Eigen::Ref<Eigen::MatrixXd> a) {
  return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(a).info() == Eigen::Success;
}

template Cholesky<Square<2>>::Cholesky(const Square<2>&);
template Square<2> Cholesky<Square<2>>::lower() const;
template Vector<2> Cholesky<Square<2>>::solve(const Vector<2>&) const;
template Square<2> Cholesky<Square<2>>::solve_lower(const Square<2>&) const;

template Cholesky<Square<3>>::Cholesky(const Square<3>&);
template Square<3> Cholesky<Square<3>>::lower() const;
template double Cholesky<Square<3>>::rcond() const;
template Vector<3> Cholesky<Square<3>>::solve(const Vector<3>&) const;
template Square<3> Cholesky<Square<3>>::solve(const Square<3>&) const;
template Vector<3> Cholesky<Square<3>>::solve_lower(const Vector<3>&) const;
template Square<3> Cholesky<Square<3>>::solve_lower(const Square<3>&) const;

template Cholesky<Square<6>>::Cholesky(const Square<6>&);
template Square<6> Cholesky<Square<6>>::lower() const;
template double Cholesky<Square<6>>::rcond() const;
template Vector<6> Cholesky<Square<6>>::solve(const Vector<6>&) const;
template Square<6> Cholesky<Square<6>>::solve(const Square<6>&) const;
template Vector<6> Cholesky<Square<6>>::solve_lower(const Vector<6>&) const;
template Square<6> Cholesky<Square<6>>::solve_lower(const Square<6>&) const;

template Cholesky<Square<12>>::Cholesky(const Square<12>&);
template Vector<12> Cholesky<Square<12>>::solve(const Vector<12>&) const;
template Eigen::Matrix<double, 12, 2> Cholesky<Square<12>>::solve(
    const Eigen::Matrix<double, 12, 2>&) const;

template Cholesky<MatrixXd>::Cholesky(const MatrixXd&);
template MatrixXd Cholesky<MatrixXd>::lower() const;
template double Cholesky<MatrixXd>::rcond() const;
template VectorXd Cholesky<MatrixXd>::solve(const VectorXd&) const;
template Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 14, 1> Cholesky<MatrixXd>::solve(
    const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 14, 1>&) const;
template MatrixXd Cholesky<MatrixXd>::solve(const MatrixXd&) const;
template VectorXd Cholesky<MatrixXd>::solve_lower(const VectorXd&) const;
template MatrixXd Cholesky<MatrixXd>::solve_lower(const MatrixXd&) const;

}  // namespace occ::internal::core
