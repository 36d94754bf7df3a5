// SPDX-License-Identifier: Apache-2.0
// Cost of many candidate poses,
//     sum_i min(|projected_i - seen_i|^2 / limit_i^2, 1),
// in the plane z = 1 and in single precision, which suffices for ranking. A point that is not in
// front of the camera costs 1.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/simd.hpp"
#include "libocc/pose/internal/point_fit.hpp"

namespace occ::internal::pose {

class LIBOCC_API ConsensusCost {
 public:
  /// `bearings`: those of the points of `seen`, with a positive z. `limit_sigmas`: limit_i in
  /// sigmas of `seen`; a point's sigma is the geometric mean over directions.
  ConsensusCost(const SeenPoints& seen, const Eigen::Matrix3Xd& bearings, double limit_sigmas,
                Simd simd = widest_simd());

  /// Stops once the sum exceeds `bar`; a result above `bar` is only a lower bound of the cost.
  float operator()(const Rigid3& pose, float bar) const;

 private:
  Simd simd_;
  int count_ = 0;              ///< number of blocks
  std::vector<float> values_;  ///< per block: X, Y, Z, observed x, y, 1 / limit^2, max. cost
};

}  // namespace occ::internal::pose
