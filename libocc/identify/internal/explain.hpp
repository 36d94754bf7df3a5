// SPDX-License-Identifier: Apache-2.0
// Internal: from a pose that three pairs suggest to everything that the pose explains.
#pragma once

#include <array>
#include <optional>

#include "libocc/identify/internal/point_pose.hpp"

namespace occ::internal::identify {

/// How a pose's blobs shine, see identify/internal/brightness.hpp.
struct Brightness {
  double chi2 = 0;        ///< each residual's part is bounded: a lamp may be half hidden
  int residuals = 0;      ///< that determine something, not mere bounds
  double log_gain = 0;    ///< grey levels over what the lamps send to the camera
  double gain_sigma = 0;  ///< 0 when no flux tells it
  bool fits = false;      ///< no worse than 99.9 % of right ones, with a residual to tell
};

/// A pose with all that agrees with it.
struct PoseHypothesis {
  FittedPose estimate;
  std::vector<Pair> pairs;      ///< sorted by sighting
  std::vector<Match> attached;  ///< weak blobs where a lamp must be
  double chi2 = 0;              ///< of the pairs and the prior, plus the misses
  int missed = 0;
  Brightness brightness;
};

bool contains(const std::vector<Pair>& pairs, const Pair& pair);
bool same_pairs(const std::vector<Pair>& a, const std::vector<Pair>& b);  ///< in any order

/// Whether the camera is in a lamp's cone (on its lit side), and not so near that no image could
/// hold it.
bool faces(const MapPoint& target, const Eigen::Vector3d& camera_position);

/// Whether a lamp at this place (camera frame) is of the size that the blob has.
bool sizes_agree(const BearingObservation& sighting, const MapPoint& target,
                 const Eigen::Vector3d& point);

/// Three namings that a pose came from.
using Naming = std::array<Pair, 3>;

/// A pair that agrees within the gate, given how well the pose is known.
struct ScoredPair {
  Pair pair;
  double score = 0;  ///< minus twice the logarithm of its likelihood, up to a constant
};

/// How a pair agrees, given how well the pose is known.
struct PairFit {
  double chi2 = 0;
  double determinant = 0;  ///< of the covariance of where the lamp is expected [rad^4]
};

/// Nothing when the lamp is not in front of the camera.
std::optional<PairFit> fit_of_pair(const AssignmentProblem& problem, const Pair& pair,
                                   const FittedPose& estimate);

/// All pairs that agree with a pose and touch neither the blobs nor the lamps of `naming`.
std::vector<ScoredPair> further_pairs(const AssignmentProblem& problem, const FittedPose& estimate,
                                      const Naming& naming);

/// Each blob and each lamp at most once, likely pairs first. Sorted by sighting.
std::vector<Pair> one_to_one(std::vector<ScoredPair> candidates);

/// Chi-square of the prior for a pose that is itself uncertain.
double prior_chi2(const AssignmentProblem& problem, const FittedPose& estimate);

/// Fits the pose to all that agrees with it and drops what then does not. `further` comes from
/// further_pairs of the same seed. Fewer than three pairs are left when nothing holds together.
PoseHypothesis explain(const AssignmentProblem& problem, const FittedPose& seed,
                       const Naming& naming, const std::vector<ScoredPair>& further);

}  // namespace occ::internal::identify
