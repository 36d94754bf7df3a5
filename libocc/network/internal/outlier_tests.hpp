// SPDX-License-Identifier: Apache-2.0
// Tests of single observations for gross errors: image points, distances, control points.
//
// A normalised residual is standard normal without gross errors (Baarda, "A testing procedure for
// use in geodetic networks", 1968). That of a control point is the length of its three components
// (chi-squared), so that an error of any direction is found.
//
// The sigmas of image points may be too small by a common factor f, those of distances and control
// points are taken as stated. With the redundancy r of such an observation, the variance of its
// residual over its own is then r (r + f^2 (1 - r)); it is r for f = 1.
#pragma once

#include <string>
#include <vector>

#include "libocc/network/internal/normal_equations.hpp"

namespace occ::internal::network {

struct OutlierCandidate {
  int index = 0;          ///< index of the observation, distance or control point
  double normalised = 0;  ///< normalised residual
  int coordinate = -1;    ///< 0, 1 or 2: the coordinate of a control point that misses most
};

/// Observations whose normalised residual exceeds the critical value, largest first.
struct OutlierCandidates {
  std::vector<OutlierCandidate> images, distances, control;
};

/// `robust_scale`: robust estimate of f; gross errors inflate sigma0 and would mask themselves.
/// Empty when the network is not determined.
OutlierCandidates find_outliers(const Network& network, const NetworkLayout& layout,
                                double robust_scale, double false_alarm, int threads);

/// Rejected distances and control points that agree with the adjusted network. An observation can
/// be rejected because of another one that was wrong.
struct AgreeingObservations {
  std::vector<int> distances, control;
};
AgreeingObservations find_agreeing(const Network& network, double robust_scale, double false_alarm,
                                   int threads);

}  // namespace occ::internal::network
