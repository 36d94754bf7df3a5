// SPDX-License-Identifier: Apache-2.0
// Which rung of the refinement to take: the cheapest that is predicted to meet a target, the most
// accurate that is predicted to fit a budget, or, with both, the cheapest that meets the target
// within the budget. Where nothing does, the best there is.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/refine.hpp"

namespace occ {

struct RungForecast {
  Rung rung = Rung::rims;
  double predicted_s = 0;  ///< of the refinement, every pose that it has to refine included
  /// Root of the trace of the position's covariance, by the bound of the observations at hand; for
  /// Rung::points with what taking the lamps' centres for those of their images adds. Nothing where
  /// the choice did not depend on it.
  std::optional<double> predicted_sigma_m;
};

struct RungChoice {
  Rung rung = Rung::rims;
  double predicted_s = 0;
  /// As above; where it was not predicted, that of the fix, as its own observations' bound has it.
  std::optional<double> predicted_sigma_m;
  bool met = true;                         ///< target and budget, as predicted
  std::string reason;                      ///< a sentence; unless met, what would be needed
  std::vector<RungForecast> alternatives;  ///< all that were considered, cheapest first
};

struct RungWish {
  /// Time left for the refinement [s], when asked; may be negative. Empty: no budget.
  std::function<double()> left_s;
  std::optional<double> target_sigma_m;
};

/// `forecasts`: at least one, their times filled in. `sigma_of` is asked, cheapest rung first, for
/// as few rungs as the choice takes (a bound costs up to as much as the rung itself); infinite when
/// the rung has no answer. Without any wish the first forecast's rung is taken.
LIBOCC_API RungChoice choose_rung(std::vector<RungForecast> forecasts, const RungWish& wish,
                                  const std::function<double(Rung)>& sigma_of);

/// The enumerator's name, e.g. "centres".
LIBOCC_API const char* to_string(Rung rung);

}  // namespace occ
