// SPDX-License-Identifier: Apache-2.0
// Chooses the rung of a refinement from a time budget and a target accuracy.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/identify/identify.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/refine/rung_choice.hpp"
#include "libocc/refine/rung_costs.hpp"

namespace occ::internal::refine {

/// A refinement that has not started: identified poses and what the caller asks for.
struct RefinementAhead {
  const std::vector<Hypothesis>& hypotheses;  ///< at least one, best first
  const std::vector<Blob>& blobs;
  const Scene& scene;
  const RefineOptions& options;  ///< its rung is used if there is neither budget nor target
  const RungCosts& costs;
  int max_candidates = 0;           ///< hypotheses that are refined at most
  const IdentifyOptions& identify;  ///< those of the hypotheses
  std::optional<double> budget_s;
  std::optional<double> target_sigma_m;
  const ImageView* image = nullptr;  ///< may be null
  bool excluded_listed = false;      ///< see Identification
};

/// `elapsed_s` returns the part of the budget that has been used when it is called.
LIBOCC_API RungChoice rung_for(const RefinementAhead& ahead,
                               const std::function<double()>& elapsed_s);

}  // namespace occ::internal::refine
