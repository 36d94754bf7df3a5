// SPDX-License-Identifier: Apache-2.0
// The covariance of what nothing is known of: infinite on the diagonal. A pose that was not found
// must not look like a certain one.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "libocc/core/abi.hpp"

namespace occ {

template <int size>
Eigen::Matrix<double, size, size> unknown_covariance() {
  Eigen::Matrix<double, size, size> covariance = Eigen::Matrix<double, size, size>::Zero();
  covariance.diagonal().setConstant(std::numeric_limits<double>::infinity());
  return covariance;
}

}  // namespace occ
