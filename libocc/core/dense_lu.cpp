// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::core {

Eigen::VectorXd solve_lu(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return a.partialPivLu().solve(b);
}

template <class Matrix>
Matrix inverse(const Matrix& a) {
  return a.inverse();
}

template Eigen::Matrix3d inverse(const Eigen::Matrix3d&);
template Eigen::Matrix<double, 5, 5> inverse(const Eigen::Matrix<double, 5, 5>&);
template Eigen::Matrix<double, 6, 6> inverse(const Eigen::Matrix<double, 6, 6>&);
template Eigen::MatrixXd inverse(const Eigen::MatrixXd&);

}  // namespace occ::internal::core
