// SPDX-License-Identifier: Apache-2.0
// About which point of a station's frame a network scales when its images shall stay as they are:
// X' = s X + (1 - s) o. It is the station's origin but where a known length can be made good by
// moving the station: the height e_z of a panorama camera's centre over its turntable, the arm of a
// camera on a known mount. One such length in a station says nothing about the scale; two that ask
// for different points fix it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/network/internal/network_layout.hpp"

namespace occ::internal::network {

struct ScaleCentres {
  std::vector<Eigen::Vector3d> station;  ///< o, in the station's frame
  std::vector<Eigen::Vector3d> mount;    ///< shift of a free mount that goes with it
  std::vector<char> height_held;         ///< of each camera: e_z is known and of no consequence
  double conflict_m = 0;  ///< between two points asked for: zero when there is a scale
};

ScaleCentres scale_centres(const Network& network, const NetworkState& state);

constexpr const char* height_name = "ez_m";

}  // namespace occ::internal::network
