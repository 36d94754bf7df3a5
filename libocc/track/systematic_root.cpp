// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/internal/systematic_root.hpp"

namespace occ::internal::track {

void SystematicUpdate::update(const Eigen::MatrixXd& rows, const Eigen::VectorXd& residuals,
                              const Eigen::MatrixXd& systematic) {
  const Eigen::Index count = rows.rows(), states = root_.cols(), known = errors_.rows();
  const Eigen::MatrixXd across = rows.transpose();
  const Eigen::MatrixXd by_noise = root_.leftCols(rows.cols()) * across;
  Eigen::MatrixXd by_errors = errors_.leftCols(rows.cols()) * across;
  by_errors.bottomRows(systematic.cols()) += systematic.transpose();
  Eigen::MatrixXd stack = Eigen::MatrixXd::Zero(count + states + known, count + states);
  stack.topLeftCorner(count, count).setIdentity();
  stack.middleRows(count, states) << by_noise, root_;
  stack.bottomRows(known) << by_errors, errors_;
  for (int i = 0; i < count; ++i) clear_below(i, static_cast<int>(stack.rows()), stack);
  const Eigen::MatrixXd square = stack.topLeftCorner(count, count);
  const auto innovation_root = square.triangularView<Eigen::Upper>();
  const Eigen::MatrixXd gain = innovation_root.solve(stack.topRightCorner(count, states));
  const Eigen::VectorXd white = innovation_root.transpose().solve(residuals);
  count_nis(square, white);
  step_ = -gain.transpose() * residuals;
  errors_ -= by_errors * gain;
  Eigen::MatrixXd left(states + count, states);
  left << root_ - by_noise * gain, gain;
  for (int i = 0; i < states; ++i) clear_below(i, static_cast<int>(left.rows()), left);
  root_ = left.topRows(states).triangularView<Eigen::Upper>();
}

/// Rows that the prediction determines a thousand times better than the measurement do not count.
void SystematicUpdate::count_nis(const Eigen::MatrixXd& innovation_root,
                                 const Eigen::VectorXd& white) {
  constexpr double min_gain = 1e-6;
  for (Eigen::Index i = 0; i < white.size(); ++i) {
    if (!(innovation_root.col(i).squaredNorm() - 1 > min_gain)) continue;
    ++dof_;
    nis_ += white[i] * white[i];
  }
}

}  // namespace occ::internal::track
