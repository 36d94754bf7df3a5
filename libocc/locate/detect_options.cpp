// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/detect_options.hpp"

#include "libocc/scene/internal/lamp_colours.hpp"

namespace occ::internal::locate {

DetectOptions detect_options_of(const Scene& scene, DetectOptions options) {
  if (!options.sensor) options.sensor = scene.sensor;
  if (options.colours.empty()) options.colours = internal::scene::stated_colours(scene.lamps);
  options.polygons = options.polygons && scene.has_straight_sides();
  options.discs = options.discs && scene.has_discs();
  options.free_forms = options.free_forms || scene.has_free_forms();
  options.hollows = options.hollows || scene.has_hollows();
  return options;
}

}  // namespace occ::internal::locate
