// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/dense_types.hpp"

namespace occ::internal::core {

template <class Matrix>
void Ldlt<Matrix>::compute(const Matrix& a) {
  ldlt_.compute(a);
}

template <class Matrix>
double Ldlt<Matrix>::rcond() const {
  return ldlt_.rcond();
}

template <class Matrix>
template <class Right>
Right Ldlt<Matrix>::solve(const Right& b) const {
  return ldlt_.solve(b);
}

template void Ldlt<Square<2>>::compute(const Square<2>&);
template Columns<2, 6> Ldlt<Square<2>>::solve(const Columns<2, 6>&) const;

template void Ldlt<Square<3>>::compute(const Square<3>&);
template Vector<3> Ldlt<Square<3>>::solve(const Vector<3>&) const;

template void Ldlt<Square<5>>::compute(const Square<5>&);
template double Ldlt<Square<5>>::rcond() const;
template Vector<5> Ldlt<Square<5>>::solve(const Vector<5>&) const;
template Square<5> Ldlt<Square<5>>::solve(const Square<5>&) const;
template Columns<5, 2> Ldlt<Square<5>>::solve(const Columns<5, 2>&) const;

template void Ldlt<Square<6>>::compute(const Square<6>&);
template Vector<6> Ldlt<Square<6>>::solve(const Vector<6>&) const;
template Columns<6, 7> Ldlt<Square<6>>::solve(const Columns<6, 7>&) const;

template void Ldlt<Square<8>>::compute(const Square<8>&);
template Vector<8> Ldlt<Square<8>>::solve(const Vector<8>&) const;
template Columns<8, 2> Ldlt<Square<8>>::solve(const Columns<8, 2>&) const;

template void Ldlt<MatrixXd>::compute(const MatrixXd&);
template VectorXd Ldlt<MatrixXd>::solve(const VectorXd&) const;
template MatrixXd Ldlt<MatrixXd>::solve(const MatrixXd&) const;

}  // namespace occ::internal::core
