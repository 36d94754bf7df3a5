// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/bearing_basis.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::pose {
namespace {

constexpr double min_diagonal = 1e-16;   // smallest diagonal entry of R, relative to the largest
constexpr int max_rotation_steps = 100;  // not reached unless two singular values nearly coincide
constexpr double converged_one_minus_cos =
    1e-15;  // 1 - cos of the angle between successive vectors

}  // namespace

TangentBasis tangent_basis(const Eigen::Vector3d& bearing) {
  TangentBasis basis;
  basis.row(0) = bearing.unitOrthogonal();
  basis.row(1) = bearing.cross(basis.row(0).transpose());
  return basis;
}

// Inverse iteration on the triangular factor R of A: (R^T R) x_next = x.
Eigen::VectorXd smallest_right_vector(const Eigen::MatrixXd& a) {
  const Eigen::Index columns = a.cols();
  const auto qr = core::pivoted_qr(a);
  Eigen::MatrixXd r = Eigen::MatrixXd::Zero(columns, columns);
  const Eigen::Index rows = std::min(columns, a.rows());
  r.topRows(rows) = qr.matrixR().topRows(rows).triangularView<Eigen::Upper>();
  for (Eigen::Index i = 0; i < columns; ++i)  // avoids a division by zero for a null space
    if (std::abs(r(i, i)) < min_diagonal * std::abs(r(0, 0)))
      r(i, i) = min_diagonal * std::abs(r(0, 0));
  Eigen::VectorXd x = Eigen::VectorXd::Unit(columns, columns - 1);
  for (int step = 0; step < max_rotation_steps; ++step) {
    Eigen::VectorXd next = r.transpose().triangularView<Eigen::Lower>().solve(x);
    next = r.triangularView<Eigen::Upper>().solve(next).normalized();
    const double change = 1 - std::abs(next.dot(x));
    x = next;
    if (!(change > converged_one_minus_cos)) break;
  }
  return qr.colsPermutation() * x;
}

}  // namespace occ::internal::pose
