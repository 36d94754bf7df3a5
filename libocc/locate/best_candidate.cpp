// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/best_candidate.hpp"

#include <cmath>
#include <sstream>
#include <vector>

#include "libocc/pose/internal/evidence.hpp"

namespace occ::internal::locate {

void take_best(Fix& fix) {
  const Candidate& best = fix.candidates.front();
  fix.cam_from_world = best.cam_from_world;
  fix.covariance = best.covariance;
  fix.position_m = best.position_m;
  fix.position_covariance_m2 = position_covariance(best.cam_from_world, best.covariance);
  fix.rms_px = best.rms_px;
  fix.lamps = best.lamps;
}

void weigh(Fix& fix, double misfit, double excluded) {
  const double best_chi2 = fix.candidates.front().chi2;
  std::vector<double> logs;
  for (const Candidate& candidate : fix.candidates)
    logs.push_back((best_chi2 - candidate.chi2) / (2 * misfit));
  const std::vector<double> shares = pose::probabilities(logs, std::log(excluded));
  double risk = shares.back();
  for (std::size_t i = 0; i < logs.size(); ++i) {
    fix.candidates[i].probability = shares[i];
    if (i > 0) risk += shares[i];
  }
  fix.risk = risk;
}

std::string rivals_message(const Fix& fix) {
  std::ostringstream text;
  text.precision(2);
  text << fix.candidates.size() << " poses fit";
  if (const auto probability = fix.candidates.front().probability)
    text << "; the best is right with a probability of " << *probability;
  return text.str();
}

}  // namespace occ::internal::locate
