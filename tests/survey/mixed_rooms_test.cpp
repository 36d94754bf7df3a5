// SPDX-License-Identifier: Apache-2.0
// Rooms with lamps of several kinds and sizes, of which single pictures do not show the sizes.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

/// Numbers of panels of 0.6 x 0.3 m, tubes of 1.2 x 0.08 m, and discs of 8 and 16 cm radius.
struct Kinds {
  int panels = 0, tubes = 0, discs = 0, large_discs = 0;
};

/// Lamps on a ceiling of 5 x 4 m, of which a fifth hangs lower.
Scene mixed_room(const Kinds& kinds, double hanging_m, Random& random) {
  const int rectangles = kinds.panels + kinds.tubes;
  const int count = rectangles + kinds.discs + kinds.large_discs;
  std::vector<Vector3d> at;
  while (static_cast<int>(at.size()) < count) {
    const Vector3d next(random.uniform(0, 5), random.uniform(0, 4),
                        2.7 - (random.uniform() < 0.2 ? hanging_m : 0));
    const auto is_near = [&](const Vector3d& other) {
      return (next - other).head<2>().norm() < 0.9;
    };
    if (std::none_of(at.begin(), at.end(), is_near)) at.push_back(next);
  }
  Scene scene = room_of(at);
  for (Lamp& lamp : scene.lamps) {
    if (lamp.id >= rectangles) {
      if (lamp.id >= rectangles + kinds.discs) lamp.radius_m = 0.16;
      continue;
    }
    lamp.shape = LampShape::rectangle;
    lamp.radius_m = 0;
    lamp.size_m = lamp.id < kinds.panels ? Eigen::Vector2d(0.6, 0.3) : Eigen::Vector2d(1.2, 0.08);
    lamp.x_axis = random.uniform() < 0.5 ? Vector3d::UnitX() : Vector3d::UnitY();
    lamp.validate();
  }
  return scene;
}

struct Rates {
  MapSums maps;
  int placed = 0, candidates = 0;
};

Rates campaign(const Kinds& kinds, double hanging_m, int seeds) {
  Rates rates;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    Random random(seed, 93);
    const Scene scene = mixed_room(kinds, hanging_m, random);
    const auto made = walk(scene, 16, seed);
    const auto found = survey(pictures_of(made), scene.camera);
    for (const MadePicture& one : made) rates.candidates += one.lamps.size() >= 4;
    if (!found.ok()) continue;
    rates.placed += static_cast<int>(found->adjustment.network.images.size());
    add(rates.maps, *found, scene, truth_of(*found, made), seed);
  }
  std::cout << "panels " << kinds.panels << ", tubes " << kinds.tubes << ", discs " << kinds.discs
            << " and " << kinds.large_discs << ", hanging " << hanging_m << " m, " << seeds
            << " rooms: " << rates.maps << ", pictures " << rates.placed << " of "
            << rates.candidates << std::endl;
  return rates;
}

TEST(MixedRooms, AreMapped) {
  for (const Kinds& kinds : {Kinds{5, 0, 4, 0}, Kinds{3, 3, 4, 0}, Kinds{0, 0, 6, 3}}) {
    const Rates rates = campaign(kinds, 0, 2);
    EXPECT_EQ(rates.maps.ok, 2);
    EXPECT_EQ(rates.maps.wrong, 0);
    EXPECT_GT(rates.placed, 0.8 * rates.candidates);
  }
}

TEST(SlowMixedRooms, HaveNoWrongLamps) {
  for (const Kinds& kinds : {Kinds{9, 0, 0, 0}, Kinds{5, 0, 4, 0}, Kinds{4, 0, 8, 0},
                             Kinds{3, 3, 4, 0}, Kinds{0, 0, 6, 3}, Kinds{0, 0, 8, 4}})
    for (const double hanging_m : {0.0, 0.4}) {
      const Rates rates = campaign(kinds, hanging_m, 20);
      EXPECT_EQ(rates.maps.wrong, 0);
      EXPECT_GE(rates.maps.ok, 12);
      EXPECT_NEAR(rates.maps.chi2 / rates.maps.dof, 1, 0.3);
    }
}

}  // namespace
}  // namespace occ::test
