// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/scene.hpp"

#include <set>

#include "libocc/core/require.hpp"
#include "libocc/scene/internal/vector_text.hpp"

namespace occ {

void Scene::validate() {
  sensor.validate();
  std::set<int> ids;
  for (Lamp& lamp : lamps) {
    lamp.validate();
    require(ids.insert(lamp.id).second, "lamps: id", lamp.id, "of one lamp only");
  }
  if (!room) return;
  require(room->size_m.allFinite() && room->size_m.minCoeff() > 0, "room.size_m",
          vector_text(room->size_m), "three positive lengths");
  require(room->wall_reflectance >= 0 && room->wall_reflectance < 1, "room.wall_reflectance",
          room->wall_reflectance, "in [0, 1)");
}

}  // namespace occ
