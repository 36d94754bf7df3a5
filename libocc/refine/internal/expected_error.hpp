// SPDX-License-Identifier: Apache-2.0
// Internal: how far off a rung is to be expected, before it is run.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::refine {

/// Root mean squares: root of the trace of the covariance, bias included.
struct ExpectedError {
  double position_m = 0, rotation_rad = 0;
};

ExpectedError expected_error(const Rigid3& cam_from_world, const Matrix6& covariance,
                             const Vector6& bias = Vector6::Zero());

/// By how much the pose is off when each lamp's centre is taken for that of its image.
/// `covariance`: the pose's, from the same centroids.
Vector6 bias_of_points(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                       const Scene& scene, const Rigid3& cam_from_world, const Matrix6& covariance,
                       double model_sigma_px);

}  // namespace occ::internal::refine
