// SPDX-License-Identifier: Apache-2.0
// The one verb: where was the camera when it took this image of these lamps? Detects blobs, names
// them, solves the pose and refines it; returns every pose that explains the image, best first.
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

struct LIBOCC_API LocateOptions {
  std::optional<Prior> prior;  ///< used to identify and to refine
  /// For the whole call; detection and identification are done when the rung is chosen, and what
  /// they took is measured. The most accurate rung that is predicted to fit is taken instead of
  /// refine.rung (its flux model is kept).
  std::optional<double> budget_s;
  /// Root of the trace of the position's covariance: the cheapest rung that is predicted to meet it
  /// is taken; together with a budget, the cheapest that meets it within the budget.
  std::optional<double> target_sigma_m;
  RungCosts costs;           ///< what each rung takes on this machine
  DetectOptions detect;      ///< its sensor is the scene's unless set
  IdentifyOptions identify;  ///< its prior is the one above
  RefineOptions refine;      ///< its prior is the one above
  int max_candidates = 16;   ///< poses that fit: refined and returned at most

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// Status: ok; ambiguous (the best candidate is in the fix, all are in `candidates`); no_lamps,
/// too_few_lamps, no_pose (also when a pose puts the lamps in place but not to size, their names
/// following from geometry alone), degenerate (the lamps are seen on a line, see identify),
/// not_converged (any candidate; the fix holds what was found so far); budget_not_met (one pose,
/// but not within the budget or not to the target as predicted: the best there is; Fix::choice says
/// what it would take). Throws std::invalid_argument when the image's size is not the camera's, or
/// the scene or the options do not validate. What the scene's effects switch off does not count
/// (Scene::as_rendered).
LIBOCC_API Result<Fix> locate(const ImageView& image, const Scene& scene,
                              const LocateOptions& options = {});

/// The same from blobs that are already detected.
LIBOCC_API Result<Fix> locate(const std::vector<Blob>& blobs, const Scene& scene,
                              const LocateOptions& options = {});

}  // namespace occ
