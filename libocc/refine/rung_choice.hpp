// SPDX-License-Identifier: Apache-2.0
// Choice of the refinement's rung from predicted times and errors: with a target, the fastest rung
// that meets it; with a time budget, the most accurate rung within it; with both, the fastest rung
// that meets the target within the budget. If no rung does, the nearest one.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/refine.hpp"

namespace occ {

/// Predicted time and error of one rung.
struct RungForecast {
  Rung rung = Rung::rims;  ///< rung of the forecast
  double predicted_s = 0;  ///< time of the refinement of all poses
  /// Root of the trace of the position's covariance, from the Cramer-Rao bound of the observations;
  /// for Rung::points plus the bias of using the lamps' centres for those of their images. Empty if
  /// the choice did not depend on it.
  std::optional<double> predicted_sigma_m;
};

/// Chosen rung, with the reason.
struct RungChoice {
  Rung rung = Rung::rims;  ///< chosen rung
  double predicted_s = 0;  ///< time of the refinement of all poses
  /// As above; if it was not predicted, the bound of the observations at the fix.
  std::optional<double> predicted_sigma_m;
  bool met = true;     ///< true if the prediction meets target and budget
  std::string reason;  ///< a sentence; if not met, it states what would be needed
  std::vector<RungForecast> alternatives;  ///< all rungs considered, fastest first
};

/// Requested time and accuracy; empty members are not requested.
struct RungWish {
  /// Returns the time left for the refinement [s]; may be negative. Empty: no budget.
  std::function<double()> left_s;
  std::optional<double> target_sigma_m;  ///< limit of the predicted error
};

/// `forecasts`: at least one, fastest first, with their times. `sigma_of` returns the predicted
/// error of a rung, infinite if the rung does not determine the position. It is called for as few
/// rungs as possible, because a bound takes up to as long as the rung itself. Without target and
/// budget the first forecast is chosen.
LIBOCC_API RungChoice choose_rung(std::vector<RungForecast> forecasts, const RungWish& wish,
                                  const std::function<double(Rung)>& sigma_of);

/// The enumerator's name, e.g. "centres".
LIBOCC_API const char* to_string(Rung rung);

}  // namespace occ
