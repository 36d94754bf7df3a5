// SPDX-License-Identifier: Apache-2.0
// A hall with lamps in a regular grid, and recordings of a vehicle in it.
#pragma once

#include <vector>

#include "tests/survey/survey_support.hpp"

namespace occ::test {

/// Hall of 40 x 20 m with a grid of 10 x 6 lamps at 5 m, a tenth of which is dark.
inline Scene hall(Random& random) {
  std::vector<Vector3d> lamps;
  for (int i = 0; i < 10; ++i)
    for (int j = 0; j < 6; ++j)
      if (random.uniform() > 0.1)
        lamps.push_back({2 + 4.0 * i + 0.01 * random.normal(),
                         1.7 + 3.3 * j + 0.01 * random.normal(), 5 + 0.005 * random.normal()});
  Scene scene = room_of(lamps);
  scene.camera = Camera::pinhole(1280, 960, 450, 450, 639.5, 479.5);
  for (Lamp& lamp : scene.lamps) lamp.radius_m = 0.15;
  return scene;
}

/// Pictures every `step_m` on `loops` rounds of an ellipse, which shrinks from round to round.
inline std::vector<MadePicture> drive(const Scene& scene, int loops, double step_m,
                                      Random& random) {
  std::vector<MadePicture> made;
  const double perimeter = 75;
  const int count = static_cast<int>(loops * perimeter / step_m);
  for (int k = 0; k < count; ++k) {
    const double turn = 2 * pi * loops * k / count;
    const double shrink = 1 - 0.15 * turn / (2 * pi);
    const Vector3d at(20 + 15 * shrink * std::cos(turn), 10 + 6 * shrink * std::sin(turn), 0.3);
    const Vector3d up(-15 * std::sin(turn), 6 * std::cos(turn), 0);
    const Vector3d target = at + Vector3d(0.02 * random.normal(), 0.02 * random.normal(), 1);
    made.push_back(
        make_picture(scene, look_at(at, target, up), "frame " + std::to_string(k), 0.03, random));
  }
  return made;
}

}  // namespace occ::test
