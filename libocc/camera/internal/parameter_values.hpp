// SPDX-License-Identifier: Apache-2.0
// Values of a camera's parameters, in the order of Camera::parameters().
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/camera/camera.hpp"

namespace occ::internal::camera {

inline Eigen::VectorXd parameter_values(const Camera& camera) {
  const std::vector<CameraParameter> parameters = camera.parameters();
  Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k)
    values[static_cast<Eigen::Index>(k)] = parameters[k].value;
  return values;
}

}  // namespace occ::internal::camera
