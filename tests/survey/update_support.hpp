// SPDX-License-Identifier: Apache-2.0
// Rooms whose lamps changed since their map was made, for tests of updates.
#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "libocc/survey/update.hpp"
#include "tests/survey/survey_support.hpp"

namespace occ::test {

/// A map with errors, the room of today, and what changed.
struct ChangedRoom {
  Scene map, now;
  std::map<int, Vector3d> moved;  // old minus new place by id
  std::set<int> gone, added;      // ids; those of new lamps are only in `now`
};

/// A map whose lamps have normal errors of this standard deviation, which it states.
inline Scene map_of(Scene scene, double sigma_m, Random& random) {
  for (Lamp& lamp : scene.lamps) {
    lamp.position_sigma_m = PerAxis(sigma_m);
    lamp.centre_m += sigma_m * Vector3d(random.normal(), random.normal(), random.normal());
  }
  return scene;
}

/// Result for the lamp of the map with this id; nothing if it is not listed.
inline const LampUpdate* of_id(const MapUpdate& update, int id) {
  for (const LampUpdate& lamp : update.lamps)
    if (lamp.lamp.id == id) return &lamp;
  return nullptr;
}

inline int count_of(const MapUpdate& update, LampFate fate) {
  return static_cast<int>(std::count_if(update.lamps.begin(), update.lamps.end(),
                                        [&](const LampUpdate& lamp) { return lamp.fate == fate; }));
}

inline UpdateOptions exact_options() {
  UpdateOptions options;
  options.survey.model_sigma_px = 1e-3;  // the blobs have no such error
  return options;
}

/// Ten lamps without symmetry.
inline Scene ten_lamps() {
  return room_of({{0.8, 0.9, 2.7},
                  {2.9, 0.7, 2.7},
                  {1.7, 1.6, 2.7},
                  {0.7, 2.8, 2.5},
                  {2.6, 2.4, 2.7},
                  {1.8, 3.3, 2.7},
                  {3.7, 1.5, 2.7},
                  {3.5, 3.2, 2.7},
                  {0.2, 1.9, 2.7},
                  {2.2, 0.3, 2.7}});
}

}  // namespace occ::test
