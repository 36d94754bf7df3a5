// SPDX-License-Identifier: Apache-2.0
// What each way from blobs with names to a pose takes and errs, on one image whose truth is known:
// closed forms on the centroids, the refinement's rungs, and OpenCV's solvers for comparison. Each
// is timed here, by the thread's own clock and over as many calls as that needs, from the same
// measured blobs; those that need a start get it from P3P over triples, within their time.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/pose/match.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/refine/rung_costs.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// One image, its blobs named by the truth.
struct LadderProblem {
  Scene scene;      ///< valid
  ImageView image;  ///< looked at, not copied
  Rigid3 truth;     ///< cam_from_world
  std::vector<Blob> blobs;
  std::vector<Match> matches;        ///< lamps that are whole in the image
  Eigen::Matrix3Xd points_in_world;  ///< their centres, a column for each match
  Eigen::Matrix2Xd points_px;        ///< their centroids
  double sigma_px = 0;               ///< of these about the projected centres, r.m.s.
  double detect_s = 0;
};

/// Detects, and names each blob after the lamp whose image's centre it is nearest to. Throws
/// std::invalid_argument as locate() does.
LIBOCC_API LadderProblem ladder_problem(const ImageView& image, const Scene& scene,
                                        const Rigid3& cam_from_world);

/// A step of the ladder.
struct LadderStep {
  const char* name;    ///< e.g. "p3p", "rims"
  const char* family;  ///< who wrote what it times: "libocc", "OpenGV", "OpenCV"
  const char* what;    ///< a phrase for people
  Rung observations;   ///< what it sees, and with it its bound: points, rims, ...
  FluxModel flux;

  /// Whether number and layout of the points allow it.
  bool (*suits)(const LadderProblem& problem);
  /// Any status but ok: no answer.
  Result<Rigid3> (*run)(const LadderProblem& problem);
};

/// All, roughly in the order of their time.
LIBOCC_API const std::vector<LadderStep>& ladder_steps();

/// Throws std::invalid_argument naming those that exist.
LIBOCC_API const LadderStep& ladder_step_named(const std::string& name);

/// Root mean squares at the truth; zero where there is no bound.
struct LadderBound {
  double position_m = 0, rotation_rad = 0;  ///< Cramer-Rao bound
  /// The same with the bias of points, which take a lamp's centre for that of its image.
  double position_expected_m = 0, rotation_expected_rad = 0;
};

/// Of what the blobs and the image at hand offer to a rung.
LIBOCC_API LadderBound ladder_bound(const LadderProblem& problem, Rung rung,
                                    FluxModel flux = FluxModel::ignore);

struct LadderOutcome {
  const char* name = "";
  bool answered = false;
  Rigid3 cam_from_world;
  double time_s = 0;  ///< of one call, the mean over as many as take `min_time_s`
  double position_error_m = 0, rotation_error_rad = 0;
  LadderBound bound;  ///< of what the step sees
};

/// Runs one step. Throws std::invalid_argument unless it suits.
LIBOCC_API LadderOutcome climb(const LadderProblem& problem, const LadderStep& step,
                               double min_time_s = 5e-5);

/// What refining takes by itself, from a pose a centimetre and half a degree off: to fit RungCosts.
struct RefineTime {
  RungWork work;
  double time_s = 0;  ///< zero when it did not succeed
};
LIBOCC_API RefineTime time_refine(const LadderProblem& problem, Rung rung, double min_time_s);

}  // namespace occ
