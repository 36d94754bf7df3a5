// SPDX-License-Identifier: Apache-2.0
// Short names of the types that the sources dense_*.cpp instantiate.
#pragma once

#include <Eigen/Core>

namespace occ::internal::core {

template <int n>
using Square = Eigen::Matrix<double, n, n>;
template <int n>
using Vector = Eigen::Matrix<double, n, 1>;
template <int n, int m>
using Columns = Eigen::Matrix<double, n, m>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

}  // namespace occ::internal::core
