// SPDX-License-Identifier: Apache-2.0
// Linear equations of a bearing: a point x of the camera lies on the bearing's line if and only if
// both rows of its tangent basis are orthogonal to x.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"

namespace occ::internal::pose {

using TangentBasis = Eigen::Matrix<double, 2, 3>;

/// Orthonormal rows, orthogonal to the unit bearing.
TangentBasis tangent_basis(const Eigen::Vector3d& bearing);

/// The unit vector x with the smallest |A x|; A has at least as many rows as it takes to fix x.
Eigen::VectorXd smallest_right_vector(const Eigen::MatrixXd& a);

}  // namespace occ::internal::pose
