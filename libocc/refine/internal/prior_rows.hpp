// SPDX-License-Identifier: Apache-2.0
// Adds a prior to the normal equations; its squared residuals sum to Prior::chi2.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/pose_normal_equations.hpp"
#include "libocc/scene/prior.hpp"

namespace occ::internal::refine {

LIBOCC_API void add_prior(const Prior& prior, const Rigid3& cam_from_world,
                          const Eigen::Vector3d& pivot, PoseNormalEquations& normal);

}  // namespace occ::internal::refine
