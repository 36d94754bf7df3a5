// SPDX-License-Identifier: Apache-2.0
// The point nearest to all of some rays in the least squares of distances, or nothing when they are
// parallel. A start: rays are weighted alike, whatever the distance.
#pragma once

#include <optional>
#include <vector>

#include "libocc/camera/camera.hpp"

namespace occ::internal::network {

std::optional<Eigen::Vector3d> intersect_rays(const std::vector<Ray>& rays);

}  // namespace occ::internal::network
