// SPDX-License-Identifier: Apache-2.0
// Flat patches of an exposure series with their noise, and both fits of a response curve to them
// (response.hpp).
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/image.hpp"
#include "libocc/photometry/response.hpp"

namespace occ::internal::photometry {

/// A patch in one image.
struct PatchLevel {
  int exposure = 0;         ///< index of the image
  double level_dn = 0;      ///< mean of the pixels
  double variance_dn2 = 0;  ///< variance of the mean
  double pixel_dn2 = 0;     ///< noise variance of one pixel, without the rounding error
};

struct FlatPatch {
  double x = 0, y = 0;             ///< centre [px]
  std::vector<PatchLevel> levels;  ///< sorted by image; only images with no pixel black or clipped
};

struct LevelRange {
  double black_dn = 0, full_scale_dn = 255;
};

/// At most `count` patches of 5 x 5 pixels that are uniform up to noise, and neither black nor
/// clipped in two images or more. They are distributed over brightness and image area.
std::vector<FlatPatch> flat_patches(const std::vector<ImageView>& images, int channel,
                                    const LevelRange& range, int count);

/// Input of both fits; exposure times are those of the images.
struct PatchSeries {
  const std::vector<FlatPatch>& patches;
  const std::vector<double>& exposures_s;
};

/// Levels at which the curve is tabulated: above black, up to full scale, at most 256.
Eigen::VectorXd curve_levels(const LevelRange& range);

/// Debevec and Malik's least squares (response.hpp). Sets the curve, its covariance, chi2 and the
/// residuals; false without convergence.
bool fit_levels(const PatchSeries& series, double smoothness, ChannelResponse& response);

/// Fits the coefficients of a basis. False without convergence or when the curve decreases between
/// observed levels. Where it decreases beyond them, it is replaced by a rising line.
bool fit_basis(const PatchSeries& series, int functions, ChannelResponse& response);

}  // namespace occ::internal::photometry
