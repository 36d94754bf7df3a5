// SPDX-License-Identifier: Apache-2.0
// Pose of the camera from one image of known lamps: detects blobs, assigns them to lamps
// (identify), solves for the pose and refines it. Returns all plausible poses, best first.
#pragma once

#include <Eigen/Core>
#include <map>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/core/status.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/identify/identify.hpp"
#include "libocc/locate/fix.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/refine/rung_costs.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Options of locate(); none needs to be set.
struct LIBOCC_API LocateOptions {
  std::optional<Prior> prior;  ///< for identification and refinement; the only one to set
  /// Time budget of the whole call. The search for poses is cut short if it takes too long
  /// (Fix::cut_short). The rung is chosen after detection and identification, whose time is
  /// measured. The most accurate rung that is predicted to fit replaces refine.rung; the flux model
  /// is kept.
  std::optional<double> budget_s;
  /// Target for the root of the trace of the position's covariance. The fastest rung that is
  /// predicted to meet it is used; with a budget, the fastest that meets it within the budget.
  std::optional<double> target_sigma_m;
  RungCosts costs;           ///< computing time of each rung on this machine
  DetectOptions detect;      ///< its sensor defaults to the scene's
  IdentifyOptions identify;  ///< without a prior of its own
  RefineOptions refine;      ///< without a prior of its own
  int max_candidates = 64;   ///< maximum number of poses that are refined and returned
  double max_risk = 1e-4;    ///< a pose is ok if it is wrong with at most this probability
  /// Probability that a lamp in an image is moved, misnamed or a reflection, for the protection
  /// level. An assumption: one fault in 1000 lamps is ten times the prior of a satellite
  /// constellation and 100 times that of a satellite in ARAIM (Blanch et al. 2015).
  double lamp_fault_probability = 1e-3;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Each candidate has a probability, the fix a risk. They follow from the evidence of its lamps
/// (their places, sizes, fluxes and codes), lamps that should be visible and are not, blobs that
/// stay unexplained and the prior, against the other candidates and against false lights. A last
/// pose in the prior is off by more than stated with a probability of 1e-2, and that of another
/// place that looks alike with 1e-5; such places are candidates, too. If the search was cut short,
/// the risk of a pose of fewer than six lamps contains the share of the groups of blobs that were
/// not tried.
///
/// Status: ok (the risk is at most max_risk); ambiguous (it is not: several candidates, most
/// probable first, or one that may be accidental); no_lamps; too_few_lamps; no_pose (also if it is
/// more probable that no candidate is right, or if a pose matches the lamps' positions but not
/// their sizes, and the assignment follows from geometry alone); degenerate (the lamps are on a
/// line in the image, see identify, or the position is less certain than their distance);
/// not_converged (for any candidate; the fix holds the last iterate); budget_not_met (one pose,
/// which is predicted to miss the budget or the target; Fix::choice states what would be needed).
/// Throws std::invalid_argument if the image does not have the camera's size, or if scene or
/// options are not valid. Effects that the scene switches off are ignored (Scene::as_rendered).
LIBOCC_API Result<Fix> locate(const ImageView& image, const Scene& scene,
                              const LocateOptions& options = {});

/// Locates the camera from detected blobs.
LIBOCC_API Result<Fix> locate(const std::vector<Blob>& blobs, const Scene& scene,
                              const LocateOptions& options = {});

}  // namespace occ
