// SPDX-License-Identifier: Apache-2.0
// Internal: what many candidate poses cost,
//     sum_i min(|projected_i - seen_i|^2 / limit_i^2, 1),
// in the plane z = 1 and in single precision, which is enough to tell good ones from bad ones. A
// point that is not in front costs 1.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/simd.hpp"
#include "libocc/pose/internal/point_fit.hpp"

namespace occ::internal::pose {

class LIBOCC_API ConsensusCost {
 public:
  /// `bearings`: of the points that were seen, with a positive z; `limit_sigmas`: in sigmas of
  /// `seen`, their geometric mean over directions.
  ConsensusCost(const SeenPoints& seen, const Eigen::Matrix3Xd& bearings, double limit_sigmas,
                Simd simd = widest_simd());

  /// Whatever is beyond `bar` is of no meaning: it is given up there.
  float operator()(const Rigid3& pose, float bar) const;

 private:
  Simd simd_;
  int count_ = 0;              ///< rounded up to whole blocks
  std::vector<float> values_;  ///< of each block: X, Y, Z, seen x, y, 1 / limit^2, most it costs
};

}  // namespace occ::internal::pose
