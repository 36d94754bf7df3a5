// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/dense.hpp"

namespace occ::internal::core {

Eigen::ColPivHouseholderQR<Eigen::MatrixXd> pivoted_qr(const Eigen::MatrixXd& a) {
  return Eigen::ColPivHouseholderQR<Eigen::MatrixXd>(a);
}

Eigen::VectorXd solve_pivoted_qr(const Eigen::MatrixXd& a, const Eigen::VectorXd& b) {
  return pivoted_qr(a).solve(b);
}

OrthogonalFactors::OrthogonalFactors(const Eigen::MatrixXd& a) : qr_(a) {}

Eigen::MatrixXd OrthogonalFactors::solve(const Eigen::MatrixXd& b) const { return qr_.solve(b); }

Eigen::MatrixXd householder_q(const Eigen::MatrixXd& a, Eigen::Index columns) {
  return Eigen::HouseholderQR<Eigen::MatrixXd>(a).householderQ() *
         Eigen::MatrixXd::Identity(a.rows(), columns);
}

}  // namespace occ::internal::core
