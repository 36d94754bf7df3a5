// SPDX-License-Identifier: Apache-2.0
// Support for the closed-loop tests: a room with four equal lamps and a route of 20 m.
#pragma once

#include "libocc/guide/closed_loop.hpp"
#include "libocc/scene/scene_file.hpp"

namespace occ::test {

inline Scene four_lamp_room() {
  return read_scene(std::string(LIBOCC_DATA) + "/scenes/kookmin_four_lamps.yaml");
}

/// Route of 4.1 m laps, one side of which passes through the middle of the room, with a dock at the
/// end.
inline Route four_lamp_route(int laps = 5) {
  RouteOptions options;
  options.closed = true;
  options.laps = laps;
  options.corner_radius_m = 0.4;
  options.dock = PlanarPose{2.4, 1.2, 0};
  return Route({{{1.6, 1.2}, {}, {}},
                {{2.8, 1.2}, {}, {}},
                {{2.8, 2.0}, {}, {}},
                {{1.2, 2.0}, {}, {}},
                {{1.2, 1.2}, {}, {}}},
               options);
}

/// Wheel noise of a good vehicle.
inline Vehicle real_vehicle() {
  Vehicle vehicle;
  vehicle.noise.drive = 0.002;
  vehicle.noise.slip = 0.002;
  vehicle.noise.sideways_slip = 0.001;
  vehicle.noise.odometry = 0.001;
  return vehicle;
}

inline LoopOptions real_options(std::uint64_t seed = 1) {
  LoopOptions options;
  options.vehicle = real_vehicle();
  options.seed = seed;
  return options;
}

/// The room with a longer lens of 3 mm.
inline Scene narrow_room() {
  Scene scene = four_lamp_room();
  const double f = 0.003 / scene.sensor.pixel_pitch_m;
  scene.camera = Camera::pinhole(640, 480, f, f, 319.5, 239.5);
  return scene;
}

}  // namespace occ::test
