// SPDX-License-Identifier: Apache-2.0
// Expected error of a rung before the refinement.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::refine {

/// Root mean square errors: root of the trace of the covariance plus the squared bias.
struct ExpectedError {
  double position_m = 0, rotation_rad = 0;
};

LIBOCC_API ExpectedError expected_error(const Rigid3& cam_from_world, const Matrix6& covariance,
                                        const Vector6& bias = Vector6::Zero());

/// Bias of the pose from using the lamps' centres for the centres of their images. `covariance`: of
/// the pose, from the same centroids.
LIBOCC_API Vector6 bias_of_points(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                                  const Scene& scene, const Rigid3& cam_from_world,
                                  const Matrix6& covariance, double model_sigma_px);

}  // namespace occ::internal::refine
