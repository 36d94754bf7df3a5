// SPDX-License-Identifier: Apache-2.0
// Covariance of the pose from the normal equations.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/pose_normal_equations.hpp"

namespace occ::internal::refine {

struct PoseCovariance {
  Matrix6 covariance = Matrix6::Zero();  ///< left perturbation; zero unless the rank is 6
  int rank = 0;                          ///< number of determined directions
};

/// Marginalises growth and log_factor. A direction is undetermined if its information is below
/// 1e-14 of the largest, after scaling by the largest of the rotation and of the translation.
LIBOCC_API PoseCovariance pose_covariance(const PoseNormalEquations& normal,
                                          const Eigen::Vector3d& pivot);

/// Information about the left perturbation; growth and log_factor are marginalised.
LIBOCC_API Matrix6 pose_information(const PoseNormalEquations& normal,
                                    const Eigen::Vector3d& pivot);

/// Like pose_information, of the lamps without a prior that `normal` includes. The difference has
/// the rounding errors of the larger of the two: where the lamps have less than 1e-12 of the
/// information, the result is zero. It is positive semi-definite.
LIBOCC_API Matrix6 lamp_information(const PoseNormalEquations& normal,
                                    const PoseNormalEquations& prior, const Eigen::Vector3d& pivot);

}  // namespace occ::internal::refine
