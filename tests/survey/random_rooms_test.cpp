// SPDX-License-Identifier: Apache-2.0
// Many rooms: no blob may be assigned to a wrong lamp, whether the lamps are irregular, in a grid,
// or in a grid with gaps. Pictures that are not decided must be held back.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

Scene random_room(int lamps, Random& random) {
  std::vector<Vector3d> at;
  while (static_cast<int>(at.size()) < lamps) {
    const Vector3d next(random.uniform(0, 5), random.uniform(0, 4), 2.7);
    const auto is_near = [&](const Vector3d& other) { return (other - next).norm() < 0.6; };
    if (std::none_of(at.begin(), at.end(), is_near)) at.push_back(next);
  }
  return room_of(at);
}

/// Grid of 1.2 x 1.0 m; each lamp is dark with the probability `dark`.
Scene random_grid(double dark, Random& random) {
  std::vector<Vector3d> at;
  for (int i = 0; i < 5; ++i)
    for (int j = 0; j < 5; ++j)
      if (random.uniform() > dark)
        at.push_back({1.2 * i + 0.003 * random.normal(), 1.0 * j + 0.003 * random.normal(), 2.7});
  return room_of(at);
}

struct Verdicts {
  int surveys = 0, pictures = 0, wrong = 0, twice = 0;
};

void add(Verdicts& verdicts, const Scene& scene, std::uint64_t seed, int count) {
  const auto made = walk(scene, count, seed);
  const auto found = survey(pictures_of(made), scene.camera);
  if (!found.ok()) return;
  ++verdicts.surveys;
  for (const int image : found->image_of_picture) verdicts.pictures += image >= 0;
  std::vector<int> truth = truth_of(*found, made);
  const int wrong = static_cast<int>(std::count(truth.begin(), truth.end(), -2));
  verdicts.wrong += wrong > 0;
  std::sort(truth.begin(), truth.end());
  const bool twice = std::adjacent_find(truth.begin(), truth.end()) != truth.end();
  verdicts.twice += twice;
  if (wrong > 0 || twice) std::cout << "seed " << seed << ": wrong " << wrong << std::endl;
}

void campaign(int seeds) {
  Verdicts irregular, grid, gaps;
  for (int seed = 1; seed <= seeds; ++seed) {
    Random random(static_cast<std::uint64_t>(seed), 77);
    const auto stream = static_cast<std::uint64_t>(seed);
    add(irregular, random_room(6 + random.below(8), random), stream, 15);
    add(grid, random_grid(0, random), stream, 15);
    add(gaps, random_grid(0.15, random), stream, 15);
  }
  for (const Verdicts* one : {&irregular, &grid, &gaps}) {
    std::cout << one->surveys << " of " << seeds << " surveys with " << one->pictures
              << " pictures, wrong " << one->wrong << ", twice " << one->twice << std::endl;
    EXPECT_EQ(one->wrong, 0);
    EXPECT_EQ(one->twice, 0);
  }
  EXPECT_GE(irregular.surveys, seeds * 9 / 10);
  EXPECT_EQ(grid.surveys, 0);  // a whole grid looks the same after each shift
}

TEST(RandomRooms, HaveNoWrongLamps) { campaign(1); }

TEST(SlowRandomRooms, HaveNoWrongLamps) { campaign(50); }

}  // namespace
}  // namespace occ::test
