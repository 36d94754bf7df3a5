// SPDX-License-Identifier: Apache-2.0
// One number for each axis, such as the standard deviations of a position.
#pragma once

#include <Eigen/Core>

namespace occ {

/// Values along x, y and z. One number stands for all three.
class PerAxis : public Eigen::Vector3d {
 public:
  /// Zeros.
  PerAxis() : Eigen::Vector3d(Eigen::Vector3d::Zero()) {}
  /// One number for all axes.
  PerAxis(double all) : Eigen::Vector3d(Eigen::Vector3d::Constant(all)) {}
  /// A vector of three numbers.
  template <class Derived>
  PerAxis(const Eigen::MatrixBase<Derived>& values) : Eigen::Vector3d(values) {}
};

}  // namespace occ
