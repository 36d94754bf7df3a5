// SPDX-License-Identifier: Apache-2.0
// Errors that several observations of a chain share: of the position of a point, the parameters of
// a camera, its mount, the clock, or the systematic errors of a PoseObservation. Each is an unknown
// with zero mean and unit variance.
//
// The poses are estimated as if each frame had errors of its own, which costs no more than exact
// values and needs no unknowns common to all poses. The covariance is that of this estimator with
// common errors (consider parameters; Schmidt, "Application of state-space methods to navigation
// problems", Advances in Control Systems 3, 1966). With the normal equations H delta = -g and
// b_kj, the derivative of the gradient g_k by error j,
//     cov(g) = H + sum_j b_j b_j^T - blockdiag(Q_k),   cov(delta) = H^-1 cov(g) H^-1,
// where Q_k is the part of H_k by which frame k counts the errors as its own.
#pragma once

#include <Eigen/Core>
#include <map>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::smooth {

/// Numbers of the errors: the same component of the same thing is the same error.
class ErrorNumbers {
 public:
  enum Kind { point, camera, mount, clock, observation };

  int of(Kind kind, std::vector<double> thing, int component) {
    thing.push_back(component);
    thing.push_back(kind);
    return numbers_.emplace(std::move(thing), static_cast<int>(numbers_.size())).first->second;
  }

 private:
  std::map<std::vector<double>, int> numbers_;
};

/// Common errors in the gradient by one pose.
template <int size>
struct CommonErrors {
  using Columns = Eigen::Matrix<double, size, Eigen::Dynamic>;
  using Block = Eigen::Matrix<double, size, size>;

  std::vector<int> numbers;       ///< those of two frames at one pose occur twice
  Columns columns{size, 0};       ///< b
  Block counted = Block::Zero();  ///< Q

  bool empty() const { return numbers.empty(); }

  /// Adds errors that are counted as this frame's own.
  void add(const std::vector<int>& added, const Columns& by_errors) {
    append(added, by_errors);
    counted += by_errors * by_errors.transpose();
  }
  void add(const CommonErrors& other) {
    append(other.numbers, other.columns);
    counted += other.counted;
  }
  /// Errors in the gradient by another pose, which is d_pose^T times this one.
  template <int other_size>
  CommonErrors<other_size> mapped(const Eigen::Matrix<double, size, other_size>& d_pose) const {
    CommonErrors<other_size> out;
    out.numbers = numbers;
    out.columns = d_pose.transpose() * columns;
    out.counted = d_pose.transpose() * counted * d_pose;
    return out;
  }

  /// Adds errors that `counted` contains already, or does not contain.
  void append(const std::vector<int>& added, const Columns& by_errors) {
    numbers.insert(numbers.end(), added.begin(), added.end());
    columns.conservativeResize(Eigen::NoChange, columns.cols() + by_errors.cols());
    columns.rightCols(by_errors.cols()) = by_errors;
  }
};

}  // namespace occ::internal::smooth
