// SPDX-License-Identifier: Apache-2.0
// The circle of poses that the rim of a disc allows.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/identify/pose_circle.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::identify {

/// Minimises the distances of the rim from a pose that is near the circle. The information contains
/// the noise of the rim, the errors that its points share and that of the lamp's size. Indices of
/// lamp and blob are not set.
PoseCircle circle_of_disc(const Rigid3& start, const Lamp& disc, const Blob& blob,
                          const Camera& camera);

}  // namespace occ::internal::identify
