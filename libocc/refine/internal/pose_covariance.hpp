// SPDX-License-Identifier: Apache-2.0
// From normal equations to the covariance of the pose.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/normal.hpp"

namespace occ::internal::refine {

struct PoseCovariance {
  Matrix6 covariance = Matrix6::Zero();  ///< of the left perturbation; zero unless the rank is 6
  int rank = 0;                          ///< directions of the pose that are determined
};

/// Growth and log_factor marginalised. A direction counts as undetermined when its information is
/// below 1e-12 of the largest, in units of the largest rotation's and the largest translation's.
PoseCovariance pose_covariance(const Normal& normal, const Eigen::Vector3d& pivot);

/// Information on the left perturbation; growth and log_factor marginalised.
Matrix6 pose_information(const Normal& normal, const Eigen::Vector3d& pivot);

}  // namespace occ::internal::refine
