// SPDX-License-Identifier: Apache-2.0
// AprilTags that link pictures which show too few whole lamps.
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>

#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

TEST(TaggedRooms, PicturesOfTwoLampsAreLinked) {
  const Scene scene = room_of({{1, 1, 2.7}, {3, 1, 2.7}, {1, 2.5, 2.7}, {3, 2.5, 2.7}});
  for (const bool on_wall : {false, true}) {
    std::vector<Rigid3> poses;
    auto made = video(scene, 60, 8, poses);
    for (std::size_t i = 0; i < made.size(); ++i)  // a rim is measured for two whole lamps only
      for (std::size_t b = 0; b < made[i].lamps.size(); ++b)
        if ((b + i / 8) % 4 >= 2) made[i].picture.blobs[b].cut_by_border = true;
    SurveyOptions options;
    options.ordered = true;
    options.tag_size_m = 0.16;
    EXPECT_EQ(survey(pictures_of(made), scene.camera, options).status, Status::too_few_lamps);
    const Eigen::Matrix3d axes = on_wall ? so3_exp({-1.2, 0, 0}) : Eigen::Matrix3d::Identity();
    add_tag(made, scene, {2, 1.9, on_wall ? 2.4 : 2.7}, 0.16, axes);
    const auto found = survey(pictures_of(made), scene.camera, options);
    ASSERT_TRUE(found.ok()) << on_wall << ": " << found.message;
    const std::vector<int> truth = truth_of(*found, made);
    EXPECT_EQ(truth.size(), 4u) << on_wall;
    EXPECT_LT(worst_distance_m(*found, scene, truth), 3e-3) << on_wall;
    const auto placed = std::count_if(found->image_of_picture.begin(),
                                      found->image_of_picture.end(), [](int i) { return i >= 0; });
    EXPECT_GT(placed, 50) << on_wall;
    for (std::size_t i = 0; i < made.size(); ++i)
      EXPECT_EQ(found->lamp_of_blob[i].size(), made[i].picture.blobs.size());
    // Without its size, tags still link the pictures.
    options.tag_size_m.reset();
    const auto free = survey(pictures_of(made), scene.camera, options);
    ASSERT_TRUE(free.ok()) << on_wall << ": " << free.message;
    EXPECT_EQ(free->scale, SurveyScale::free);
    EXPECT_EQ(free->lamps.size(), 4u);
  }
}

/// Videos of a camera with a narrow view below irregular lamps or a grid, with a tag near their
/// middle that is on the ceiling or hangs lower, tilted by up to 0.4 rad.
MapSums campaign(bool grid, bool with_tag, int seeds) {
  MapSums maps;
  int placed = 0, pictures = 0;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    Random random(seed, 31);
    std::vector<Vector3d> at;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const double spread = grid ? 0.003 : 0.2;
        at.push_back({1.2 * i + spread * random.normal(), 1.1 * j + spread * random.normal(),
                      2.7 - (grid ? 0 : 0.1 * random.uniform())});
      }
    Scene scene = room_of(at);
    scene.camera = Camera::pinhole(1280, 720, 1100, 1100, 639.5, 359.5);
    std::vector<Rigid3> poses;
    auto made = video(scene, 60, seed, poses);
    if (with_tag)
      add_tag(
          made, scene, {1.2 + 0.2 * random.normal(), 0.55, 2.7 - 0.3 * random.uniform()}, 0.16,
          so3_exp({random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), random.uniform(0, 3)}));
    SurveyOptions options;
    options.ordered = true;
    const auto found = survey(pictures_of(made), scene.camera, options);
    pictures += 60;
    if (!found.ok()) continue;
    placed += static_cast<int>(found->adjustment.network.images.size());
    add(maps, *found, scene, truth_of(*found, made), seed);
  }
  std::cout << (grid ? "grid" : "irregular") << (with_tag ? ", tag: " : ", no tag: ") << maps
            << ", pictures " << placed << " of " << pictures << std::endl;
  return maps;
}

TEST(TaggedRooms, HaveNoWrongLamps) {
  const MapSums maps = campaign(true, true, 2);
  EXPECT_EQ(maps.ok, 2);
  EXPECT_EQ(maps.wrong, 0);
}

TEST(SlowTaggedRooms, HaveNoWrongLamps) {
  constexpr int seeds = 60;
  for (const bool grid : {false, true}) {
    const MapSums without = campaign(grid, false, seeds), with = campaign(grid, true, seeds);
    EXPECT_EQ(with.wrong, 0);
    EXPECT_GE(with.ok, without.ok);
    EXPECT_NEAR(with.chi2 / with.dof, 1, 0.3);
  }
}

}  // namespace
}  // namespace occ::test
