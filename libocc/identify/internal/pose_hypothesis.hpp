// SPDX-License-Identifier: Apache-2.0
// Verification of candidate poses: a pose from three pairs is extended to all pairs that agree with
// it, refitted, and checked for lamps that should be visible but are not.
//
// A pair agrees when e' (S + J C J')^-1 e <= gate_sigma^2, with the residual e, its covariance S
// and derivative J (pose_fit.hpp), and the covariance C of the pose. Each observation and each map
// point is used at most once; pairs with a higher likelihood take precedence.
#pragma once

#include <array>
#include <optional>

#include "libocc/identify/internal/pose_fit.hpp"
#include "libocc/identify/symmetry.hpp"

namespace occ::internal::identify {

/// Agreement of fluxes and sizes with the map, see brightness.hpp.
struct Brightness {
  double chi2 = 0;        ///< robust: the term of one residual is bounded
  int residuals = 0;      ///< number of measurements without mere bounds, less one for the gain
  double log_gain = 0;    ///< logarithm of grey levels over power received by the camera
  double gain_sigma = 0;  ///< standard deviation of log_gain; 0 if no flux determines it
  bool fits = false;      ///< has residuals, and chi2 is below its 99.9 % quantile
};

/// A pose with all pairs that agree with it.
struct PoseHypothesis {
  FittedPose estimate;
  std::vector<Pair> pairs;      ///< sorted by observation
  std::vector<Match> attached;  ///< partial blobs at the predicted image of a lamp
  double chi2 = 0;              ///< pairs and prior, plus the penalties for missed lamps
  double outline_misfit = 0;    ///< see OutlineMisfit
  int missed = 0;               ///< lamps that should be visible but match no blob
  double poses_scored = 0;      ///< poses that had been scored by votes when it was found
  Brightness brightness;
};

/// Three pairs that determine a pose.
using Assignment = std::array<Pair, 3>;

/// A pair inside the gate.
struct ScoredPair {
  Pair pair;
  double score = 0;  ///< -2 log likelihood up to a constant
};

/// Agreement of a pair with an uncertain pose.
struct PairFit {
  double chi2 = 0;
  double determinant = 0;  ///< determinant of S + J C J' [rad^4]
};

/// Pairs of a hypothesis, without the partial blobs that are attached to lamps.
std::vector<Pair> pairs_of(const AssignmentProblem& problem, const Hypothesis& hypothesis);

bool contains(const std::vector<Pair>& pairs, const Pair& pair);
bool same_pairs(const std::vector<Pair>& a, const std::vector<Pair>& b);  ///< in any order

/// Squared distance of a pose from an estimate, in sigmas of the estimate.
double squared_sigmas(const Rigid3& pose, const FittedPose& estimate);

/// True if the camera is inside the visibility cone of the point (on the lit side of a lamp) and
/// farther away than two radii; nearer than that, no image contains the whole lamp.
bool faces(const MapPoint& map_point, const Eigen::Vector3d& camera_position);

/// True if the apparent radius of a disc at `point` (camera frame) agrees with the measured one.
bool sizes_agree(const BearingObservation& observation, const MapPoint& map_point,
                 const Eigen::Vector3d& point);

/// Empty when the map point is not in front of the camera.
std::optional<PairFit> fit_of_pair(const AssignmentProblem& problem, const Pair& pair,
                                   const FittedPose& estimate);

/// Pairs that agree with the pose and share no observation and no map point with the assignment.
std::vector<ScoredPair> additional_pairs(const AssignmentProblem& problem,
                                         const FittedPose& estimate, const Assignment& assignment);

/// Selects pairs greedily by score, each observation and map point at most once. Sorted by
/// observation.
std::vector<Pair> one_to_one(std::vector<ScoredPair> candidates);

/// Chi-square of the prior; the covariance of the pose is added to that of the prior.
double prior_chi2(const AssignmentProblem& problem, const FittedPose& estimate);

/// Fits the pose to all pairs that agree with it and removes outliers. `further` is the result of
/// additional_pairs() for the same pose. Fewer than three pairs remain when none are consistent.
PoseHypothesis verify_hypothesis(const AssignmentProblem& problem, const FittedPose& seed,
                                 const Assignment& assignment,
                                 const std::vector<ScoredPair>& further);

/// Attaches partial blobs (cut by the border or merged) to the lamps that must be there. Counts and
/// penalises the lamps that should be well inside the image but match no blob.
void account_for_unpaired_lamps(const AssignmentProblem& problem, PoseHypothesis& hypothesis);

/// True if the lamps are collinear within the errors of their blobs, so that every rotation about
/// the line agrees with the image. `attached` lamps count as well.
LIBOCC_API bool appears_collinear(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                                  const Rigid3& pose, const std::vector<Match>& attached = {});

/// Rotates the pose about the line through three lamps. Returns all local minima of the prior's
/// chi-square; without prior, rotations by equal steps.
LIBOCC_API std::vector<Rigid3> rotations_about_line(const AssignmentProblem& problem,
                                                    const Assignment& assignment,
                                                    const Rigid3& pose);

/// The points in the columns; if they are exactly on a line, one is moved off it by a millionth of
/// their distance: P3P has no solution for points on a line. The rotation about it is arbitrary.
LIBOCC_API Eigen::Matrix3d off_their_line(const Eigen::Matrix3d& points);

/// True if the blobs are almost on a line in the image, as those of a row of lamps.
bool appear_as_row(const AssignmentProblem& problem);

/// True if three lamps are almost on a line.
LIBOCC_API bool are_a_row(const AssignmentProblem& problem, int a, int b, int c);

/// Motion that maps the lamps matched by `best` to those matched by `rival`.
Symmetry find_symmetry(const AssignmentProblem& problem, const PoseHypothesis& best,
                       const PoseHypothesis& rival);

}  // namespace occ::internal::identify
