// SPDX-License-Identifier: Apache-2.0
// Free parameters of a network's cameras as columns of Camera::parameters().
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libocc/network/network.hpp"

namespace occ::internal::network {

/// Parameters that a free parameter changes: one, or fx_px and fy_px in their given ratio.
struct ParameterColumns {
  int column = 0;  ///< index into Camera::parameters(); the value is that of the free parameter
  int tied = -1;   ///< index of the parameter that changes in proportion; -1: none
};

/// Columns of a free parameter, or nothing if the camera has no parameter with this name.
std::optional<ParameterColumns> parameter_columns(const std::vector<CameraParameter>& parameters,
                                                  const std::string& name);

}  // namespace occ::internal::network
