// SPDX-License-Identifier: Apache-2.0
// Linear equations of a bearing: a point x in the camera frame lies on the bearing's line if and
// only if both rows of the bearing's tangent basis B fulfil B x = 0.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

using TangentBasis = Eigen::Matrix<double, 2, 3>;

/// Two orthonormal rows, orthogonal to the unit bearing.
LIBOCC_API TangentBasis tangent_basis(const Eigen::Vector3d& bearing);

/// The unit vector x with the smallest |A x|: the last right singular vector. A has at least as
/// many rows as columns, less one.
LIBOCC_API Eigen::VectorXd smallest_right_vector(const Eigen::MatrixXd& a);

}  // namespace occ::internal::pose
