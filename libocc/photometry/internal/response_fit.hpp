// SPDX-License-Identifier: Apache-2.0
// The two ways from flat places to a curve.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/photometry/internal/flat_places.hpp"
#include "libocc/photometry/response.hpp"

namespace occ::internal::photometry {

/// What both fits are given; exposure times are those of the images.
struct SeriesPlaces {
  const std::vector<FlatPlace>& places;
  const std::vector<double>& exposures_s;
};

/// Levels at which the curve is described: above black, up to full scale.
Eigen::VectorXd curve_levels(const LevelRange& range);

/// Debevec and Malik's least squares, see response.hpp. Fills in the curve, its covariance and what
/// is said of residuals; false when its steps come to no end.
bool fit_levels(const SeriesPlaces& series, double smoothness, ChannelResponse& response);

/// By the basis; false when it ends in a curve that falls among the levels seen, or in none. What
/// falls beyond them is projected.
bool fit_basis(const SeriesPlaces& series, int functions, ChannelResponse& response);

}  // namespace occ::internal::photometry
