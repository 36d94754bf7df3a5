// SPDX-License-Identifier: Apache-2.0
// Internal: which phase, clock and symbols of a slot code explain samples best.
#pragma once

#include <vector>

#include "libocc/codes/decode_samples.hpp"
#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ::internal::codes {

struct SlotFit {
  double total = 0;  ///< log likelihood of the best symbols
  double clock_error = 0;
  int shift = 0;                              ///< steps from the beginning of a period to time 0
  std::vector<std::vector<double>> evidence;  ///< log likelihood by symbol and value
  std::vector<int> values;                    ///< the likeliest
  double gained = 0;  ///< sum of weighted squares that the light sent explains
  double excess = 0;  ///< sum of weighted squares about constant light, less the noise's
  double rival = 0;   ///< log likelihood over that of the best phase that says something else
};

/// Of samples that are not empty.
SlotFit fit_slots(const std::vector<LightSample>& samples, const SlotCode& code,
                  const DecodeSamplesOptions& options);

/// Evidence of each bit for 1 against 0.
std::vector<double> bit_evidence(const std::vector<std::vector<double>>& evidence,
                                 int bits_per_symbol);

}  // namespace occ::internal::codes
