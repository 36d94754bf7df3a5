// SPDX-License-Identifier: Apache-2.0
// Internal: the sub-pixel rim of a disc and the ellipse through it.
//
// Where the outline runs rather along the rows each column gives one rim point, elsewhere each row
// does: no pixel serves many points, which keeps them independent. Along such a line the signal is
// compared with that of a plateau ending in a Gaussian edge; the shift of the edge is the
// least-squares one under the edge's own derivative as weight. That weight is even and the misfit
// of a wrong blur is odd about the edge, so the shift is unbiased for any symmetric blur, and next
// to optimal for the right one.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/blob.hpp"
#include "libocc/detect/internal/component.hpp"
#include "libocc/detect/internal/ellipse_fit.hpp"
#include "libocc/detect/internal/patch.hpp"

namespace occ::internal::detect {

struct Rim {
  std::vector<RimPoint> points;
  EllipseFit fit;
  Eigen::Matrix3d common_covariance_px2 =
      Eigen::Matrix3d::Zero();                                   ///< see Blob::rim_covariance_px2
  Eigen::Matrix2d light_response_px2 = Eigen::Matrix2d::Zero();  ///< as in Blob
  double blur_px = 0;   ///< sigma of the edge, pixel box included; 0 when saturated
  bool merged = false;  ///< the outline is not that of one ellipse; there are no points then
};

/// Nothing when the blob has no plateau with a rim around it. `blur_px`: a first guess.
std::optional<Rim> measure_rim(const Patch& patch, const Component& component, double blur_px);

/// The same for a disc that is clipped at full scale: the rim at half of full scale, which lies
/// outside the true one by about as much all around.
std::optional<Rim> measure_saturated_rim(const Patch& patch, const Component& component);

/// What the points scatter beyond their sigmas is the lamp's or the lens's doing: they get it.
void widen_sigmas(Rim& rim);

}  // namespace occ::internal::detect
