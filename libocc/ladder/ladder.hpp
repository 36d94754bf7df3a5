// SPDX-License-Identifier: Apache-2.0
// Error and time of each method that computes a pose from assigned blobs, on one image with known
// truth: closed forms on centroids and corners, the rungs of the refinement, and, for comparison,
// OpenCV's solvers and methods of the literature. All methods use the same measured blobs and are
// timed by the CPU clock of the thread over many calls. Methods that need a start value get it from
// P3P over triples; the time of that is included.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/pose/solver.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/refine/rung_costs.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// One image with its blobs assigned to lamps by the true pose.
struct LadderProblem {
  Scene scene;                       ///< valid
  ImageView image;                   ///< not copied: must outlive the problem
  Rigid3 truth;                      ///< true cam_from_world
  std::vector<Blob> blobs;           ///< all detected blobs
  std::vector<Match> matches;        ///< lamps that are wholly in the image
  Eigen::Matrix3Xd points_in_world;  ///< centres of the matched lamps [m], 3 x matches
  Eigen::Matrix2Xd points_px;        ///< centroids of the matched blobs, 2 x matches
  /// Corners of the matched rectangles whose images have four, in the order of the matches [m].
  Eigen::Matrix3Xd corners_in_world;
  Eigen::Matrix2Xd corners_px;  ///< their images, 2 x corners
  double sigma_px = 0;          ///< r.m.s. distance per axis of centroids and projected centres
  double detect_s = 0;          ///< time of detection, not included in a method's time
};

/// Detects blobs and assigns each lamp the blob nearest to the centre of its image under the true
/// pose. Throws std::invalid_argument like locate().
LIBOCC_API LadderProblem ladder_problem(const ImageView& image, const Scene& scene,
                                        const Rigid3& cam_from_world);

/// One method of the ladder.
struct LadderStep {
  const char* name;    ///< e.g. "p3p", "rims"
  const char* family;  ///< "libocc", the package of the implementation, or "literature"
  const char* what;    ///< description for tables
  Rung observations;   ///< observations that it uses; they determine its bound
  FluxModel flux;      ///< flux model that it uses; determines its bound, too

  /// Returns true if the number and the layout of the points allow it.
  bool (*suits)(const LadderProblem& problem);
  /// Returns the pose; a status other than ok means no answer.
  Result<Rigid3> (*run)(const LadderProblem& problem);
};

/// All methods, roughly from the fastest to the slowest.
LIBOCC_API const std::vector<LadderStep>& ladder_steps();

/// Methods that were left out of this build; empty with the default options.
LIBOCC_API const std::vector<MissingMethod>& missing_ladder_steps();

/// Returns the method of that name. Throws std::invalid_argument for an unknown name (listing the
/// existing ones) and for a missing method (naming the CMake option).
LIBOCC_API const LadderStep& ladder_step_named(const std::string& name);

/// Root mean square errors at the true pose; zero if there is no bound.
struct LadderBound {
  double position_m = 0, rotation_rad = 0;  ///< Cramer-Rao bound
  /// Bound plus the bias of the rung `points`, which uses the lamp's centre for that of its image.
  double position_expected_m = 0, rotation_expected_rad = 0;
};

/// Bound of the observations that a rung uses in this image.
LIBOCC_API LadderBound ladder_bound(const LadderProblem& problem, Rung rung,
                                    FluxModel flux = FluxModel::ignore);

/// Time and error of one method on one image.
struct LadderOutcome {
  std::string name;       ///< LadderStep::name
  bool answered = false;  ///< false: the method returned no pose, and the errors are undefined
  Rigid3 cam_from_world;  ///< pose of the method
  double time_s = 0;      ///< mean time of a call, over as many calls as take `min_time_s`
  double position_error_m = 0, rotation_error_rad = 0;  ///< distance and angle from the true pose
  LadderBound bound;                                    ///< bound of its observations
};

/// Runs and times one method. Throws std::invalid_argument if it does not suit the problem.
LIBOCC_API LadderOutcome run_step(const LadderProblem& problem, const LadderStep& step,
                                  double min_time_s = 5e-5);

/// Time of a refinement alone, from a pose 9 mm and 0.6 degrees off; the data to fit RungCosts.
struct RefineTime {
  RungWork work;      ///< numbers of measurements
  double time_s = 0;  ///< zero if it failed
};
/// Times one rung of the refinement over at least min_time_s [s].
LIBOCC_API RefineTime time_refine(const LadderProblem& problem, Rung rung, double min_time_s);

}  // namespace occ
