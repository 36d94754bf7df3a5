// SPDX-License-Identifier: Apache-2.0
// Results of localisation as numbers, to be compared with those of an earlier version.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "libocc/locate/fix.hpp"
#include "tests/identify/reference_support.hpp"

namespace occ::test {

/// Logarithms of the standard deviations, and correlations; a zero where a covariance is infinite.
inline void append(std::vector<double>& numbers, const Matrix6& covariance) {
  if (!covariance.allFinite()) {
    numbers.push_back(0);
    return;
  }
  const Vector6 sigmas = covariance.diagonal().cwiseSqrt();
  for (Eigen::Index i = 0; i < 6; ++i) {
    numbers.push_back(std::log(sigmas[i]));
    for (Eigen::Index k = 0; k < i; ++k)
      numbers.push_back(covariance(i, k) / (sigmas[i] * sigmas[k]));
  }
}

inline double log_or_floor(double value) { return std::log(std::max(value, 1e-100)); }

/// The fix and its first candidates. `poses`: false leaves out ill-conditioned poses.
inline void add_fix(CaseResults& results, const Fix& fix, bool poses = true) {
  results.add("risk", fix.risk ? log_or_floor(*fix.risk) : 1);
  results.add("candidates", static_cast<double>(fix.candidates.size()));
  std::vector<double> numbers, covariances, chi2, lamps;
  for (std::size_t i = 0; poses && i < std::min<std::size_t>(4, fix.candidates.size()); ++i) {
    const Candidate& c = fix.candidates[i];
    append(numbers, c.cam_from_world);
    append(covariances, c.covariance);
    for (const double value :
         {c.rms_px, c.chi2, 1.0 * c.dof, c.variance_factor, c.estimated_map_sigma_m.value_or(-1),
          c.estimated_size_sigma.value_or(-1), log_or_floor(c.probability.value_or(1))})
      chi2.push_back(value);
    for (const auto& [id, blob] : c.lamps) lamps.push_back(id + 1e-3 * blob.centroid_px.x());
  }
  results.summarise("poses", numbers);
  results.summarise("covariances", covariances);
  results.summarise("chi2", chi2);
  if (!lamps.empty()) results.summarise("lamps", lamps);
  for (const int id : fix.excluded_lamps) results.add("excluded", id);
  if (fix.cut_short) results.add("cut_short", 1);
  if (!fix.taken_as_exact.empty())
    results.add("exact", static_cast<double>(fix.taken_as_exact.size()));
  if (fix.choice) results.add("rung", static_cast<double>(fix.choice->rung));
}

template <typename Value>
void add_status(CaseResults& results, const Result<Value>& found) {
  results.add("status", static_cast<double>(found.status));
  if (!found.message.empty()) results.add("message", joined(found.message));
}

}  // namespace occ::test
