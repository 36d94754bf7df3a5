// SPDX-License-Identifier: Apache-2.0
// Bundle adjustment of a network: the values that make
//
//     sum over observations of |(projected - seen) / sigma|^2
//
// least, over stations, points, bodies, mounts and the cameras' free parameters, together with
// distances, control points and priors. Levenberg and Marquardt's steps on analytic derivatives;
// points and bodies are eliminated (internal/normal_equations.hpp), the datum is free during the
// steps and set afterwards (datum.hpp). Gross errors: first robust estimation (Huber, then Tukey,
// with the scale from the median), then Baarda's data snooping: the observation whose normalised
// residual is the largest beyond the critical value goes, one for each point and image at a time,
// and all is adjusted again (Baarda, "A testing procedure for use in geodetic networks", 1968).
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

struct AdjustOptions {
  bool robust = true;  ///< gross errors are expected
  bool snooping = true;
  double false_alarm = 0.01;      ///< probability that snooping takes any good observation away
  int max_iterations = 100;       ///< of each stage
  double tolerance_sigma = 1e-6;  ///< it ends when a step is shorter, all unknowns together
  int threads = 2;                ///< at least 1; any number gives the same bits
  Datum datum;                    ///< in which the result is given; nearest to the start

  LIBOCC_API void validate() const;
};

struct AdjustProgress {
  const char* stage = "";  ///< "robust", "least squares" or "snooping"
  int iteration = 0;
  double cost = 0;  ///< half the weighted sum of squares, as the stage counts it
  int rejected = 0;
};

/// Return false to stop: the result so far is returned as `not_converged`.
using AdjustCallback = std::function<bool(const AdjustProgress&)>;

struct RejectedObservation {
  int observation = 0;    ///< index into Network::observations
  double normalised = 0;  ///< residual over its sigma when it was rejected; infinite: not in view
  std::string reason;     ///< "robust", "snooping", "not in view", "no agreement"
};

struct RejectedDistance {
  int distance = 0;  ///< index into Network::distances
  double normalised = 0;
};

struct Adjustment {
  Network network;  ///< adjusted; rejected observations have used == false
  int iterations = 0;
  double cost = 0;       ///< half the weighted sum of squares of what is used
  int observations = 0;  ///< numbers: two for each image point used, one for each distance, ...
  int unknowns = 0;
  int defect = 0;      ///< of the datum, 0 to 7
  int redundancy = 0;  ///< observations - unknowns + defect
  double sigma0 = 1;   ///< sqrt(2 cost / redundancy); 1 without redundancy
  std::vector<RejectedObservation> rejected;
  std::vector<RejectedDistance> rejected_distances;
  std::vector<std::string> warnings;  ///< of points left out, for example
};

/// Status ok; too_few_lamps: fewer targets than an image or the network needs; degenerate: blocks
/// that share nothing, or something that no observation determines (the message names it);
/// not_converged. The state so far is always in the value. Throws std::invalid_argument as
/// check_network does, and for options that make no sense.
LIBOCC_API Result<Adjustment> adjust(const Network& network, const AdjustOptions& options = {},
                                     const AdjustCallback& progress = {});

/// Residuals in pixels, seen minus projected, for every image observation; not a number of pixels
/// but infinite where the camera does not show the target.
LIBOCC_API std::vector<Eigen::Vector2d> image_residuals_px(const Network& network);

}  // namespace occ
