// SPDX-License-Identifier: Apache-2.0
#include "tests/support/nees.hpp"

#include <Eigen/Cholesky>

namespace occ::test {

double nees(const Eigen::Ref<const Eigen::VectorXd>& error,
            const Eigen::Ref<const Eigen::MatrixXd>& covariance) {
  return error.dot(covariance.ldlt().solve(error));
}

}  // namespace occ::test
