// SPDX-License-Identifier: Apache-2.0
// Recordings of a camera with a narrow view, such as that of a phone below a low ceiling: most
// frames show two or three lamps, which the rims of the lamps and the neighbours must link.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <iostream>

#include "tests/survey/survey_support.hpp"

namespace occ::test {
namespace {

Scene low_room(Random& random) {
  const int count = 5 + random.below(5);
  std::vector<Vector3d> at;
  while (static_cast<int>(at.size()) < count) {
    const Vector3d next(random.uniform(0, 4), random.uniform(0, 3),
                        2.8 - (random.uniform() < 0.3 ? random.uniform(0, 0.4) : 0));
    const auto is_near = [&](const Vector3d& other) {
      return (next - other).head<2>().norm() < 0.6;
    };
    if (std::none_of(at.begin(), at.end(), is_near)) at.push_back(next);
  }
  Scene scene = room_of(at);
  scene.camera = Camera::pinhole(1280, 960, 1150, 1150, 639.5, 479.5);
  return scene;
}

/// One round below the middle of the lamps, with an unsteady hand.
std::vector<MadePicture> round_of(const Scene& scene, int frames, Random& random) {
  Vector3d middle = Vector3d::Zero();
  for (const Lamp& lamp : scene.lamps)
    middle += lamp.centre_m / static_cast<double>(scene.lamps.size());
  const double start = random.uniform(0, 2 * pi);
  std::vector<MadePicture> made;
  for (int k = 0; k < frames; ++k) {
    const double s = static_cast<double>(k) / frames, turn = start + 4 * s;
    const Vector3d at(middle.x() + 1.3 * std::cos(turn), middle.y() + 1.1 * std::sin(turn),
                      0.6 + 0.3 * std::sin(7 * s));
    Vector3d target = 0.4 * at + 0.6 * middle;
    target += Vector3d(0.3 * std::sin(9 * s), 0.3 * std::cos(5 * s), 0);
    target.z() = 2.8;
    const double roll = start + 2.5 * s + 0.02 * random.normal();
    made.push_back(make_picture(scene, look_at(at, target, {std::cos(roll), std::sin(roll), 0}),
                                "frame " + std::to_string(k), 0.03, random));
  }
  return made;
}

struct Recording {
  Scene scene;  // the lamps of all its rooms
  std::vector<MadePicture> frames;
};

/// A camera comes near the danger cylinder of three lamps and moves along it. The centres of the
/// lamps hardly determine its poses there.
Recording along_a_danger_cylinder(Random& random) {
  Recording made{uneven_room(), {}};
  constexpr int frames = 50, before = 20;
  const double radius = random.uniform(0.98, 1.2), height = random.uniform(0.2, 0.9);
  const double noise_px = random.uniform(0.01, 0.1), sense = random.uniform() < 0.5 ? -1 : 1;
  for (int k = 0; k < frames; ++k) {
    const double turn = 1.7 + sense * 0.03 * std::max(0, k - before);
    const Vector3d on_circle(1.823 + radius * std::cos(turn), 0.514 + radius * std::sin(turn),
                             height);
    const Vector3d at = on_circle + Vector3d(0, 0.04, 0) * std::max(0, before - k);
    const Rigid3 pose = look_at(at, {1.75, 1.2, 2.7}, {1, 0.01 * k, 0});
    Scene visible = made.scene;
    if (k >= before) visible.lamps.resize(3);  // the cylinder's radius is 1.093 m
    made.frames.push_back(
        make_picture(visible, pose, "frame " + std::to_string(k), noise_px, random));
  }
  return made;
}

struct NarrowRates {
  MapSums maps;
  int placed = 0, frames = 0;
};

/// Lamps in rows of equal distances.
Scene regular_room(Random& random) {
  std::vector<Vector3d> at;
  const double step = random.uniform(0.7, 1.2);
  for (int x = 0; x < 4; ++x)
    for (int y = 0; y < 3; ++y) at.push_back({step * x, step * y, 2.8});
  Scene scene = room_of(at);
  scene.camera = low_room(random).camera;
  return scene;
}

Recording recording_in(const Scene& scene, int frames, Random& random) {
  return {scene, round_of(scene, frames, random)};
}

Recording one_room(Random& random) { return recording_in(low_room(random), 100, random); }

/// A round in one room and then one in another.
Recording two_rooms(Random& random) {
  const Vector3d offset(20, 0, 0);
  Recording made = recording_in(low_room(random), 60, random);
  Recording other = recording_in(low_room(random), 60, random);
  const int count = static_cast<int>(made.scene.lamps.size());
  for (Lamp& lamp : other.scene.lamps) {
    lamp.centre_m += offset;
    lamp.id += count;
    made.scene.lamps.push_back(lamp);
  }
  for (MadePicture& one : other.frames) {
    one.picture.name += " of the other room";
    for (int& lamp : one.lamps) lamp += count;
    one.pose.translation -= one.pose.rotation * offset;
    made.frames.push_back(one);
  }
  return made;
}

NarrowRates campaign(int seeds, const std::function<Recording(Random&)>& record) {
  NarrowRates rates;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(seeds); ++seed) {
    Random random(seed, 17);
    const Recording made = record(random);
    SurveyOptions options;
    options.ordered = true;
    const auto found = survey(pictures_of(made.frames), made.scene.camera, options);
    for (const MadePicture& one : made.frames) rates.frames += one.lamps.size() >= 2;
    if (!found.ok()) {
      std::cout << "seed " << seed << ": " << found.message << std::endl;
      continue;
    }
    rates.placed += static_cast<int>(std::count_if(found->image_of_picture.begin(),
                                                   found->image_of_picture.end(),
                                                   [](int image) { return image >= 0; }));
    add(rates.maps, *found, made.scene, truth_of(*found, made.frames), seed);
  }
  std::cout << seeds << " rooms: " << rates.maps << ", frames " << rates.placed << " of "
            << rates.frames << std::endl;
  return rates;
}

TEST(NarrowViews, AreMapped) {
  const NarrowRates rates = campaign(4, one_room);
  EXPECT_EQ(rates.maps.ok, 4);
  EXPECT_EQ(rates.maps.wrong, 0);
  EXPECT_GT(rates.placed, 0.6 * rates.frames);  // without links of two lamps, 0.45
}

TEST(NarrowViews, NeedTheOrderOfTheirFrames) {
  Random random(1, 17);
  Recording made = one_room(random);
  const auto shows_four = [](const MadePicture& one) { return one.lamps.size() > 3; };
  made.frames.erase(std::remove_if(made.frames.begin(), made.frames.end(), shows_four),
                    made.frames.end());
  const auto found = survey(pictures_of(made.frames), made.scene.camera);
  EXPECT_EQ(found.status, Status::too_few_lamps);
  EXPECT_NE(found.message.find("or three lamps in frames of one motion"), std::string::npos)
      << found.message;
}

TEST(NarrowViews, AreMappedAlongADangerCylinder) {
  const NarrowRates rates = campaign(3, along_a_danger_cylinder);
  EXPECT_EQ(rates.maps.wrong, 0);
  EXPECT_GE(rates.placed, 0.98 * rates.frames);
}

TEST(SlowNarrowViews, AreMappedAlongADangerCylinder) {
  const NarrowRates rates = campaign(40, along_a_danger_cylinder);
  EXPECT_EQ(rates.maps.wrong, 0);
  EXPECT_GE(rates.placed, 0.98 * rates.frames);
  EXPECT_NEAR(rates.maps.chi2 / rates.maps.dof, 1, 0.3);
}

TEST(SlowNarrowViews, HaveNoWrongLamps) {
  const NarrowRates rates = campaign(40, one_room);
  EXPECT_EQ(rates.maps.wrong, 0);
  EXPECT_GE(rates.maps.ok, 36);
  EXPECT_GT(rates.placed, 0.7 * rates.frames);
  EXPECT_NEAR(rates.maps.chi2 / rates.maps.dof, 1, 0.3);
}

TEST(SlowNarrowViews, OfRegularRoomsAreNotWrong) {
  const auto record = [](Random& random) {
    return recording_in(regular_room(random), 100, random);
  };
  EXPECT_EQ(campaign(40, record).maps.wrong, 0);
}

TEST(SlowNarrowViews, OfAFastCameraAreNotWrong) {
  const auto record = [](Random& random) { return recording_in(low_room(random), 25, random); };
  EXPECT_EQ(campaign(40, record).maps.wrong, 0);
}

TEST(SlowNarrowViews, OfTwoRoomsAreNotJoined) { EXPECT_EQ(campaign(40, two_rooms).maps.wrong, 0); }

}  // namespace
}  // namespace occ::test
