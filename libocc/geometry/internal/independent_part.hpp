// SPDX-License-Identifier: Apache-2.0
// A pose observation whose systematic errors are eliminated.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/pose_observation.hpp"

namespace occ::internal::geometry {

struct IndependentPart {
  PoseObservation observation;  ///< without systematic errors
  /// Derivative of its gradient by the systematic errors. Its information contains the square of
  /// this: their effect, as if it were independent noise.
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_systematic;
};

LIBOCC_API IndependentPart independent_part(const PoseObservation& seen);

}  // namespace occ::internal::geometry
