// SPDX-License-Identifier: Apache-2.0
// Bundle adjustment of a network. Minimises
//
//     sum over observations of |(projected - observed) / sigma|^2
//
// over stations, points, bodies, mounts and the cameras' free parameters. Distances, control points
// and priors are further observations. Levenberg-Marquardt steps with analytic derivatives
// eliminate points and bodies (internal/normal_equations.hpp). The network is free during the
// steps; the datum is set afterwards (datum.hpp).
//
// Gross errors are removed in two stages. Robust estimation uses Huber's, then Tukey's loss, with
// the scale from the median residual. Data snooping then rejects the observation with the largest
// normalised residual above the critical value, one for each point and image at a time, and adjusts
// again (Baarda, "A testing procedure for use in geodetic networks", 1968).
// Covariances: precision.hpp.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/network/datum.hpp"
#include "libocc/network/network.hpp"

namespace occ {

/// Options of adjust().
struct AdjustOptions {
  bool robust = true;             ///< robust estimation; needed if gross errors are expected
  bool snooping = true;           ///< data snooping after it
  double false_alarm = 0.01;      ///< probability that snooping rejects any correct observation
  int max_iterations = 100;       ///< limit for each stage
  double tolerance_sigma = 1e-6;  ///< converged when the norm of a step, in sigmas, is below
  int threads = 2;                ///< at least 1; any number gives the same bits
  Datum datum;                    ///< datum of the result; defined relative to the start values

  /// Throws std::invalid_argument naming the field and its value.
  LIBOCC_API void validate() const;
};

/// State of an adjustment after one iteration.
struct AdjustProgress {
  const char* stage = "";  ///< "robust", "least squares" or "snooping"
  int iteration = 0;       ///< starts at 0 in each stage
  double cost = 0;         ///< half the weighted sum of squares, with the stage's loss function
  int rejected = 0;        ///< number of observations rejected so far
};

/// Return false to stop: the result so far is returned as `not_converged`.
using AdjustCallback = std::function<bool(const AdjustProgress&)>;

/// An image observation that was removed as a gross error.
struct RejectedObservation {
  int observation = 0;    ///< index into Network::observations
  double normalised = 0;  ///< residual / its sigma at rejection; infinite: not in view
  std::string reason;     ///< "robust", "snooping", "not in view", "no agreement"
};

/// A distance that was removed as a gross error.
struct RejectedDistance {
  int distance = 0;       ///< index into Network::distances
  double normalised = 0;  ///< residual / its sigma at rejection
};

/// Result of adjust(), with the numbers that describe the fit.
struct Adjustment {
  Network network;       ///< adjusted; rejected observations have used == false
  int iterations = 0;    ///< total of all stages
  double cost = 0;       ///< half the weighted sum of squares of the used observations
  int observations = 0;  ///< scalar ones: two per used image point, one per distance, ...
  int unknowns = 0;      ///< number of scalar unknowns
  int defect = 0;        ///< datum defect, 0 to 7
  int redundancy = 0;    ///< observations - unknowns + defect
  double sigma0 = 1;     ///< sqrt(2 cost / redundancy); 1 without redundancy
  std::vector<RejectedObservation> rejected;         ///< in the order of rejection
  std::vector<RejectedDistance> rejected_distances;  ///< in the order of rejection
  std::vector<std::string> warnings;                 ///< for example, points that were left out
};

/// Adjusts a network. Status: ok; too_few_lamps: fewer targets than a station or the network needs;
/// degenerate: blocks without a common target, or unknowns that no observation determines (the
/// message names them); not_converged. The value always holds the last state. Throws
/// std::invalid_argument as check_network() and check_datum() do, and for invalid options.
LIBOCC_API Result<Adjustment> adjust(const Network& network, const AdjustOptions& options = {},
                                     const AdjustCallback& progress = {});

/// Residuals (observed - projected) [px] of all image observations; infinite where the target is
/// not in view.
LIBOCC_API std::vector<Eigen::Vector2d> image_residuals_px(const Network& network);

}  // namespace occ
