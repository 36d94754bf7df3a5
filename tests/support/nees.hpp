// SPDX-License-Identifier: Apache-2.0
// Decompositions of matrices, compiled once for all tests.
#pragma once

#include <Eigen/Core>

namespace occ::test {

/// Normalised estimation error squared, e^T C^-1 e, of an error and its covariance.
double nees(const Eigen::Ref<const Eigen::VectorXd>& error,
            const Eigen::Ref<const Eigen::MatrixXd>& covariance);

}  // namespace occ::test
