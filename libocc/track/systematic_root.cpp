// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/internal/systematic_root.hpp"

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::track {

void SystematicUpdate::update(const Eigen::MatrixXd& rows, const Eigen::VectorXd& residuals,
                              const Eigen::MatrixXd& systematic, Eigen::Index uncertain) {
  const Eigen::Index count = rows.rows(), states = root_.cols();
  const Eigen::MatrixXd across = rows.transpose();
  const Eigen::MatrixXd by_noise = root_.leftCols(rows.cols()) * across;
  Eigen::MatrixXd by_errors = errors_.leftCols(rows.cols()) * across;
  by_errors.bottomRows(systematic.cols()) += systematic.transpose();
  const Eigen::Index certain = errors_.rows() - uncertain;
  const Eigen::MatrixXd shifts = shifts_of(rows, systematic.rightCols(uncertain));
  Eigen::MatrixXd stack =
      Eigen::MatrixXd::Zero(count + states + certain + shifts.rows(), count + states);
  stack.topLeftCorner(count, count).setIdentity();
  stack.middleRows(count, states) << by_noise, root_;
  stack.middleRows(count + states, certain) << by_errors.topRows(certain), errors_.topRows(certain);
  stack.bottomLeftCorner(shifts.rows(), count) = shifts;
  for (int i = 0; i < count; ++i) clear_below(i, static_cast<int>(stack.rows()), stack);
  const Eigen::MatrixXd square = stack.topLeftCorner(count, count);
  const auto gain_root = square.triangularView<Eigen::Upper>();
  const Eigen::MatrixXd gain = gain_root.solve(stack.topRightCorner(count, states));
  count_nis(uncertain > 0 ? innovation_root(by_noise, by_errors) : square, residuals);
  step_ = -gain.transpose() * residuals;
  errors_ -= by_errors * gain;
  Eigen::MatrixXd left(states + count, states);
  left << root_ - by_noise * gain, gain;
  for (int i = 0; i < states; ++i) clear_below(i, static_cast<int>(left.rows()), left);
  root_ = left.topRows(states).triangularView<Eigen::Upper>();
}

/// Effects of the shift of each measured state by the errors, as if the shifts were independent.
Eigen::MatrixXd SystematicUpdate::shifts_of(const Eigen::MatrixXd& rows,
                                            const Eigen::MatrixXd& systematic) {
  Eigen::MatrixXd shifts(rows.cols() * systematic.cols(), rows.rows());
  if (systematic.cols() == 0) return shifts;
  const auto svd =
      core::jacobi_svd<Eigen::MatrixXd>(rows, Eigen::ComputeThinU | Eigen::ComputeThinV);
  for (Eigen::Index i = 0; i < systematic.cols(); ++i) {
    const Eigen::VectorXd shift = svd.solve(systematic.col(i));
    shifts.middleRows(i * rows.cols(), rows.cols()) = (rows * shift.asDiagonal()).transpose();
  }
  return shifts;
}

/// Root of S.
Eigen::MatrixXd SystematicUpdate::innovation_root(const Eigen::MatrixXd& by_noise,
                                                  const Eigen::MatrixXd& by_errors) {
  const Eigen::Index count = by_noise.cols();
  Eigen::MatrixXd stack(count + by_noise.rows() + by_errors.rows(), count);
  stack << Eigen::MatrixXd::Identity(count, count), by_noise, by_errors;
  for (int i = 0; i < count; ++i) clear_below(i, static_cast<int>(stack.rows()), stack);
  return stack.topRows(count);
}

/// Rows that the prediction determines a thousand times better than the measurement do not count.
void SystematicUpdate::count_nis(const Eigen::MatrixXd& innovation_root,
                                 const Eigen::VectorXd& residuals) {
  const Eigen::VectorXd white =
      innovation_root.triangularView<Eigen::Upper>().transpose().solve(residuals);
  constexpr double min_gain = 1e-6;
  for (Eigen::Index i = 0; i < white.size(); ++i) {
    if (!(innovation_root.col(i).squaredNorm() - 1 > min_gain)) continue;
    ++dof_;
    nis_ += white[i] * white[i];
  }
}

}  // namespace occ::internal::track
