// SPDX-License-Identifier: Apache-2.0
// Systematic errors in a filter (consider parameters): constants of unit variance that measurements
// depend on and that the filter does not estimate. Only their correlation with the state is kept.
//
// The error of the state is R^T u + C^T beta, with u and the systematic errors beta independent and
// of unit variance: P = R^T R + C^T C. Measurements as rows W, residuals r and derivatives B by
// beta have the innovation covariance and the gain
//     S = I + |R W^T|^2 + |C W^T + B^T|^2,   K = (R^T R W^T + C^T (C W^T + B^T)) S^-1.
// After the update C+ = C - (C W^T + B^T) K^T, and R+ is a root of the rows [R (I - W^T K^T); K^T].
// K and the root of S come from the reflections that clear the first columns of
//     [I            0]
//     [R W^T        R]
//     [C W^T + B^T  C].
// R+ and C+ hold for any gain. Where B is computed from noise, a gain that depends on C and B would
// estimate the error from that noise. For errors with uncertain derivatives
// (PoseObservation::uncertain_systematic) the rows of C are therefore left out, and a row W_i u_i
// for each state takes their place, with B = W u: as if the shifts u of the states were independent
// noise.
//
// Source: Schmidt, "Application of state-space methods to navigation problems", Advances in Control
// Systems 3, 1966; Tapley, Schutz, Born, Statistical Orbit Determination, 2004, ch. 6.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/track/internal/covariance_root.hpp"
#include "libocc/track/internal/root_update.hpp"

namespace occ::internal::track {

/// The systematic errors that a state depends on.
template <int states>
struct SystematicRoot {
  using Root = Eigen::Matrix<double, states, states>;

  std::vector<int> numbers;  ///< those of the last measurement are at the end
  Eigen::Matrix<double, Eigen::Dynamic, states> rows = {};  ///< C

  bool empty() const { return numbers.empty(); }

  /// Moves the errors of a measurement to the end and adds the new ones. Of more than
  /// `max_errors`, those that have not been used for the longest time become independent: their
  /// variance moves to R.
  void use(const std::vector<int>& used, Root& root) {
    // Positions of sixty lamps: those in view and those of the last minutes.
    constexpr std::size_t max_errors = 192;
    std::vector<int> order;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      if (std::find(used.begin(), used.end(), numbers[i]) == used.end())
        order.push_back(static_cast<int>(i));
    const std::size_t room = std::max(max_errors, used.size()) - used.size();
    const std::size_t forgotten = order.size() > room ? order.size() - room : 0;
    forget({order.begin(), order.begin() + static_cast<std::ptrdiff_t>(forgotten)}, root);
    order.erase(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(forgotten));
    const auto kept = static_cast<Eigen::Index>(order.size() + used.size());
    SystematicRoot next;
    next.rows.setZero(kept, states);
    for (const int row : order) {
      next.rows.row(static_cast<Eigen::Index>(next.numbers.size())) = rows.row(row);
      next.numbers.push_back(numbers[static_cast<std::size_t>(row)]);
    }
    for (const int number : used) {
      const auto known = std::find(numbers.begin(), numbers.end(), number);
      if (known != numbers.end())
        next.rows.row(static_cast<Eigen::Index>(next.numbers.size())) =
            rows.row(known - numbers.begin());
      next.numbers.push_back(number);
    }
    *this = std::move(next);
  }

 private:
  void forget(const std::vector<int>& forgotten, Root& root) const {
    for (const int row : forgotten) {
      RootStack<states, 1> stack(root);
      stack.template append<1>() = rows.row(row);
      root = stack.root();
    }
  }
};

/// Update by a measurement of the first states.
class LIBOCC_API SystematicUpdate {
 public:
  /// Root R, errors C, and a data equation of the first states; the columns of its `systematic` are
  /// those of the last rows of C, of which the last `uncertain` have uncertain derivatives.
  template <class Root, class Errors, int measured>
  SystematicUpdate(const Root& root, const Errors& errors, const DataEquation<measured>& seen,
                   int uncertain)
      : root_(root), errors_(errors) {
    update(seen.rows, seen.residuals, seen.systematic, uncertain);
  }

  double nis() const { return nis_; }
  int dof() const { return dof_; }
  const Eigen::VectorXd& step() const { return step_; }
  const Eigen::MatrixXd& root() const { return root_; }
  const Eigen::MatrixXd& errors() const { return errors_; }

 private:
  void update(const Eigen::MatrixXd& rows, const Eigen::VectorXd& residuals,
              const Eigen::MatrixXd& systematic, Eigen::Index uncertain);
  static Eigen::MatrixXd shifts_of(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& systematic);
  static Eigen::MatrixXd innovation_root(const Eigen::MatrixXd& by_noise,
                                         const Eigen::MatrixXd& by_errors);
  void count_nis(const Eigen::MatrixXd& innovation_root, const Eigen::VectorXd& residuals);

  double nis_ = 0;
  int dof_ = 0;
  Eigen::VectorXd step_;
  Eigen::MatrixXd root_, errors_;
};

}  // namespace occ::internal::track
