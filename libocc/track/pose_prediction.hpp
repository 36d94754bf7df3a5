// SPDX-License-Identifier: Apache-2.0
// Where a filter expects a body to be.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/unknown_covariance.hpp"

namespace occ {

struct PosePrediction {
  double time_s = 0;
  Rigid3 body_from_world;
  Matrix6 covariance = unknown_covariance<6>();  ///< see geometry/rigid.hpp
  Vector6 velocity = Vector6::Zero();            ///< see geometry/motion.hpp
  Matrix6 velocity_covariance = unknown_covariance<6>();
};

}  // namespace occ
