// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/pan_tilt_plan.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "libocc/core/require.hpp"

namespace occ {

PanTiltKnot PanTiltPlan::at(double along_m) const {
  const auto after =
      std::upper_bound(knots.begin(), knots.end(), along_m,
                       [](double m, const PanTiltKnot& knot) { return m < knot.along_m; });
  if (after == knots.begin()) return {along_m, after->pan_rad, after->tilt_rad};
  const PanTiltKnot& before = *(after - 1);
  if (after == knots.end()) return {along_m, before.pan_rad, before.tilt_rad};
  const double share = (along_m - before.along_m) / (after->along_m - before.along_m);
  return {along_m, before.pan_rad + share * (after->pan_rad - before.pan_rad),
          before.tilt_rad + share * (after->tilt_rad - before.tilt_rad)};
}

void PanTiltPlan::validate() const {
  require(!knots.empty(), "knots", knots.size(), "at least one");
  for (std::size_t i = 0; i < knots.size(); ++i) {
    const std::string name = "knots[" + std::to_string(i) + "]";
    require(std::isfinite(knots[i].along_m), name + ".along_m", knots[i].along_m, "finite");
    require(std::isfinite(knots[i].pan_rad), name + ".pan_rad", knots[i].pan_rad, "finite");
    require(std::isfinite(knots[i].tilt_rad), name + ".tilt_rad", knots[i].tilt_rad, "finite");
    if (i > 0)
      require(knots[i].along_m >= knots[i - 1].along_m, name + ".along_m", knots[i].along_m,
              "not less than the previous one");
  }
}

}  // namespace occ
