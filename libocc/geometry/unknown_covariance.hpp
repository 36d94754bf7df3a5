// SPDX-License-Identifier: Apache-2.0
// Covariance of an unknown quantity: infinite on the diagonal, so that a pose that was not found
// differs from a certain one.
#pragma once

#include <Eigen/Core>
#include <limits>

#include "libocc/core/abi.hpp"

namespace occ {

/// Infinite variances, zero correlations.
template <int size>
Eigen::Matrix<double, size, size> unknown_covariance() {
  Eigen::Matrix<double, size, size> covariance = Eigen::Matrix<double, size, size>::Zero();
  covariance.diagonal().setConstant(std::numeric_limits<double>::infinity());
  return covariance;
}

}  // namespace occ
