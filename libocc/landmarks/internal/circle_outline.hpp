// SPDX-License-Identifier: Apache-2.0
// Internal: fits an ellipse to the outline of a disc. Points of the outline are sub-pixel edges on
// profiles across it: an edge is where a sharp step would have the same integral as the profile.
// The ellipse is c + S u for all unit vectors u, with a symmetric matrix S.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/landmarks/internal/grey_image.hpp"

namespace occ::internal::landmarks {

/// An ellipse with the residuals of its outline.
struct EllipseOutline {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();  ///< S [px]
  /// Cofactors of the centre, for edges of unit variance.
  Eigen::Matrix2d cofactors = Eigen::Matrix2d::Identity();
  std::vector<double> residuals;  ///< residuals around the ellipse [px]; zero for an outlier
  int outliers = 0;
};

/// Fits an ellipse near `outline`, which has start values of centre and shape. max_reach_px: half
/// length of the profiles, before the neighbouring disc. False if the outline is not whole or has
/// too little contrast.
bool fit_outline(const GreyImage& grey, double max_reach_px, EllipseOutline& outline);

/// Covariances [px^2] of the centres. Neighbouring edges are correlated, by noise and by
/// interpolation; the correlation is estimated from the residuals of all discs.
std::vector<Eigen::Matrix2d> centre_covariances(const std::vector<EllipseOutline>& outlines);

}  // namespace occ::internal::landmarks
