// SPDX-License-Identifier: Apache-2.0
// Internal: maximum-likelihood phase, clock error and symbols of a slot code for given samples.
//
// Samples are folded into one period of the code and summed in steps of a fraction of a chip. For
// each clock error and each phase (a whole number of steps) the log likelihood of all symbol values
// follows from these sums.
#pragma once

#include <vector>

#include "libocc/codes/decode_samples.hpp"
#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"

namespace occ::internal::codes {

struct SlotFit {
  double total = 0;        ///< log likelihood of the best symbols, up to a constant
  double clock_error = 0;  ///< relative
  int shift = 0;           ///< phase: steps from the beginning of a period to time 0
  std::vector<std::vector<double>> evidence;  ///< log likelihood [symbol][value]
  std::vector<int> values;                    ///< most likely value of each symbol
  double gained = 0;                          ///< chi-square that the transmitted light explains
  double excess = 0;  ///< chi-square about constant light minus its expectation for pure noise
  /// Other values of the symbols, of phases whose likelihood is almost as high.
  std::vector<std::vector<int>> rivals;
};

/// Fits a slot code to one or more samples.
SlotFit fit_slots(const std::vector<LightSample>& samples, const SlotCode& code,
                  const DecodeSamplesOptions& options);

/// Log likelihood ratio of 1 against 0 for each bit, from the log likelihoods [symbol][value].
std::vector<double> bit_evidence(const std::vector<std::vector<double>>& evidence,
                                 int bits_per_symbol);

}  // namespace occ::internal::codes
