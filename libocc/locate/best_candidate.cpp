// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/best_candidate.hpp"

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

}  // namespace occ::internal::locate
