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
// the scale from the median residual; stations, points and bodies whose observations disagree get
// the placement with most inliers (internal/consensus.hpp). Distances and control points take no
// part in it if the images determine the network without them: an accurate one that is wrong would
// outweigh the rays of its targets. Those that contradict the others by more than 2 % are rejected
// after it (internal/known_consensus.hpp). Data snooping then rejects the
// observation with the largest normalised residual above the critical value, one for each point and
// image at a time, and adjusts again (Baarda, "A testing procedure for use in geodetic networks",
// 1968). Distances and control points are tested like image points; those that agree with the
// result after all are used again. An image that keeps fewer than three targets is left out.
//
// Whatever is rejected or left out is listed, and what this changes is a warning: a datum that
// rests on fewer observations, a point that keeps two rays, whose errors along them are not
// detected. Covariances: precision.hpp.
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
  double residual_m = 0;  ///< measured minus adjusted length, at the end
  std::string name;       ///< "distance 2 (p21 to p33, 2 m)"
};

/// A control point that was removed as a gross error. It remains a point of the network.
struct RejectedControl {
  int control = 0;        ///< index into Network::control
  double normalised = 0;  ///< length of the residual in its sigmas at rejection
  int coordinate = 0;     ///< 0, 1, 2: x, y or z differs most
  double residual_m = 0;  ///< known minus adjusted value of that coordinate, at the end
  std::string name;       ///< "control point 2 (p11)"
};

/// Something observed that is not in the adjustment: a station, point or body, which keeps its
/// start value, or a distance or control point of such a point.
struct LeftOut {
  /// Kind of the element.
  enum class Kind {
    station,   ///< a station, of one image unless there is a rig
    point,     ///< a point
    body,      ///< a body
    distance,  ///< a measured distance
    control    ///< a control point
  };
  Kind kind = Kind::point;  ///< selects the list of `index`
  int index = 0;            ///< into Network::stations, points, bodies, distances or control
  std::string name;    ///< "station s2", "point 7", "body tag 3", "distance 2 (p21 to p33, 2 m)"
  std::string reason;  ///< a clause: "is observed in one image only"
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
  std::vector<RejectedControl> rejected_control;     ///< in the order of rejection
  std::vector<LeftOut> left_out;                     ///< in the order of LeftOut::Kind
  /// Points (indices) with rejected rays that keep two rays, whose errors along the rays' plane are
  /// not detected, or at most half of their rays, which may agree by chance.
  std::vector<int> weak_points;
  double rejected_share = 0;          ///< rejected image points over those given, 0 to 1
  std::vector<std::string> warnings;  ///< a sentence for each thing that the user should check
};

/// Adjusts a network. Status: ok, with a message that counts what was rejected; ambiguous:
/// distances or control points contradict each other and each may be wrong, or so many image
/// points were rejected that the rest may agree by chance; too_few_lamps: fewer targets than the
/// network needs; degenerate: blocks without a common target, or unknowns that no observation
/// determines (the message names them); not_converged. The value always holds the last state.
/// Stations whose targets are too few or hardly determine their pose, such as three near whose
/// danger cylinder they are, are left out (Adjustment::left_out).
/// Throws std::invalid_argument as check_network() and check_datum() do, and for invalid options.
LIBOCC_API Result<Adjustment> adjust(const Network& network, const AdjustOptions& options = {},
                                     const AdjustCallback& progress = {});

/// Residuals (observed - projected) [px] of all image observations; infinite where the target is
/// not in view.
LIBOCC_API std::vector<Eigen::Vector2d> image_residuals_px(const Network& network);

}  // namespace occ
