// SPDX-License-Identifier: Apache-2.0
// The whole path on simulated frames: image -> blobs -> names -> pose, and what it says when it
// cannot.
#include "libocc/locate/locate.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::irregular_room;
using test::random_room_pose;
using test::square_room;

double position_error_m(const Fix& fix, const Rigid3& truth) {
  return (fix.position_m - truth.origin_in_source()).norm();
}

/// A random pose from which at least `least` lamps are whole in the image, and one that is not
/// whole is out of it, so that nothing depends on how much of a lamp the border leaves.
Rigid3 pose_with_lamps(Random& random, const Scene& scene, int least, double tilt_rad = 0.25) {
  while (true) {
    const Rigid3 pose = random_room_pose(random, tilt_rad);
    SimulateOptions options;
    options.noise = false;
    int whole = 0;
    bool cut = false;
    for (const LampTruth& lamp : simulate(scene, pose, options).lamps) {
      whole += lamp.whole;
      cut = cut || lamp.in_view != lamp.whole;
    }
    if (whole >= least && !cut) return pose;
  }
}

Image constant_image(int width, int height, std::uint8_t level) {
  Image image;
  image.width = width;
  image.height = height;
  image.u8.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), level);
  return image;
}

TEST(Locate, EffectsThatAreOffDoNotCount) {
  Scene scene = irregular_room();
  scene.camera = Camera::pinhole(640, 480, 420, 420, 320, 240, {-0.3, 0.1, 0, 0});
  scene.sensor.response = Response::srgb;
  for (Lamp& lamp : scene.lamps) lamp.frequency_hz = 1000;
  const Rigid3 truth = look_at({1.9, 2.1, 0.3}, {2, 2, 3}, {0, 1, 0});
  for (const Effect effect : {Effect::distortion, Effect::response, Effect::modulation})
    scene.effects.set(effect, Use::off);
  const Image image = simulate(scene, truth).image;
  const Result<Fix> fix = locate(image.view(), scene);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_LT(position_error_m(*fix, truth), 1e-3);
  scene.effects = {};
  const Result<Fix> otherwise = locate(image.view(), scene);
  EXPECT_FALSE(otherwise.ok() && position_error_m(*otherwise, truth) < 1e-3);
}

TEST(Locate, FindsTheCameraWithoutCodeOrPrior) {
  const Scene scene = irregular_room();
  Random random(1);
  for (int trial = 0; trial < 10; ++trial) {
    const Rigid3 truth = pose_with_lamps(random, scene, 4);
    SimulateOptions options;
    options.seed = static_cast<std::uint64_t>(trial);
    const Rendered rendered = simulate(scene, truth, options);
    const Result<Fix> fix = locate(rendered.image.view(), scene);
    ASSERT_EQ(fix.status, Status::ok) << "trial " << trial << ": " << fix.message;
    EXPECT_LT(position_error_m(*fix, truth), 1e-3) << "trial " << trial;
    EXPECT_EQ(fix->candidates.size(), 1u);
    EXPECT_LT(fix->rms_px, 0.05);
    for (const LampTruth& lamp : rendered.lamps) {
      if (!lamp.whole) continue;
      ASSERT_EQ(fix->lamps.count(lamp.id), 1u) << "lamp " << lamp.id << ", trial " << trial;
      EXPECT_LT((fix->lamps.at(lamp.id).centroid_px - lamp.image_centre_px).norm(), 0.1);
    }
  }
}

TEST(Locate, ASquareOfLampsIsAmbiguousUntilAPriorBreaksIt) {
  const Scene scene = square_room();
  Random random(2);
  const Rigid3 truth = pose_with_lamps(random, scene, 4, 0.1);
  const Rendered rendered = simulate(scene, truth);
  const Result<Fix> without = locate(rendered.image.view(), scene);
  EXPECT_EQ(without.status, Status::ambiguous) << without.message;
  EXPECT_EQ(without->candidates.size(), 4u);

  LocateOptions options;
  options.prior.emplace();
  options.prior->heading_rad = heading_rad(truth) + 0.2;
  options.prior->heading_sigma_rad = 20 * pi / 180;
  const Result<Fix> with = locate(rendered.image.view(), scene, options);
  ASSERT_EQ(with.status, Status::ok) << with.message;
  EXPECT_LT(position_error_m(*with, truth), 2e-3);
}

TEST(Locate, NamesCodedLampsThroughARollingShutter) {
  Scene scene = square_room();
  const double codes_hz[] = {2000, 2500, 3000, 3500};
  for (std::size_t i = 0; i < 4; ++i) {
    scene.lamps[i].frequency_hz = codes_hz[i];
    scene.lamps[i].radius_m = 0.17;
  }
  scene.camera = Camera::pinhole(1280, 960, 845, 845, 639.5, 479.5);
  scene.sensor.row_time_s = 1 / 47540.0;
  scene.sensor.exposure_s = 6e-5;
  Random random(3);
  const Rigid3 truth = pose_with_lamps(random, scene, 4, 0.1);
  const Result<Fix> fix = locate(simulate(scene, truth).image.view(), scene);
  ASSERT_EQ(fix.status, Status::ok) << fix.message;
  EXPECT_EQ(fix->lamps.size(), 4u);
  EXPECT_LT(position_error_m(*fix, truth), 0.01);
}

// Over 500 frames the normalised estimation error squared of the position, summed, is chi-square
// with 1500 degrees of freedom when the stated covariance is true.
TEST(Locate, StatedPositionCovarianceIsTrue) {
  const Scene scene = irregular_room();
  Random random(4);
  double nees = 0;
  int frames = 0;
  for (int trial = 0; trial < 500; ++trial) {
    const Rigid3 truth = pose_with_lamps(random, scene, 4);
    SimulateOptions options;
    options.seed = 100 + static_cast<std::uint64_t>(trial);
    const Result<Fix> fix = locate(simulate(scene, truth, options).image.view(), scene);
    ASSERT_EQ(fix.status, Status::ok) << "trial " << trial << ": " << fix.message;
    const Eigen::Vector3d error = fix->position_m - truth.origin_in_source();
    nees += error.dot(fix->position_covariance_m2.inverse() * error);
    ++frames;
  }
  const auto [low, high] = test::chi2_interval(3.0 * frames);
  EXPECT_GT(nees, low) << "mean NEES " << nees / frames << " of 3";
  EXPECT_LT(nees, high) << "mean NEES " << nees / frames << " of 3";
}

TEST(Locate, TheSameImageGivesTheSameBits) {
  const Scene scene = irregular_room();
  Random random(5);
  const Rendered rendered = simulate(scene, pose_with_lamps(random, scene, 2));
  const Result<Fix> first = locate(rendered.image.view(), scene);
  const Result<Fix> second = locate(rendered.image.view(), scene);
  EXPECT_EQ(first->cam_from_world.matrix(), second->cam_from_world.matrix());
  EXPECT_EQ(first->covariance, second->covariance);
}

TEST(Locate, BlackAndWhiteImagesHoldNoLamps) {
  const Scene scene = irregular_room();
  for (const int level : {0, 128, 255}) {
    const Image image = constant_image(640, 480, static_cast<std::uint8_t>(level));
    const Result<Fix> fix = locate(image.view(), scene);
    EXPECT_EQ(fix.status, Status::no_lamps) << "level " << level;
    EXPECT_FALSE(fix.message.empty());
    EXPECT_TRUE(fix->candidates.empty());
  }
}

TEST(Locate, TwoLampsAreTooFewAndTheBlobsAreReturned) {
  Scene scene = square_room();
  scene.lamps.resize(2);
  Random random(6);
  const Rigid3 pose = pose_with_lamps(random, scene, 2);
  const Image image = simulate(scene, pose).image;
  LocateOptions by_centres;
  by_centres.detect.rims = false;
  const Result<Fix> fix = locate(image.view(), scene, by_centres);
  EXPECT_EQ(fix.status, Status::too_few_lamps) << fix.message;
  EXPECT_EQ(fix->blobs.size(), 2u);
  // The outlines determine the pose, but not which of two equal lamps is which.
  const Result<Fix> by_outlines = locate(image.view(), scene);
  EXPECT_EQ(by_outlines.status, Status::ambiguous) << by_outlines.message;
  ASSERT_EQ(by_outlines->candidates.size(), 2u);
  double nearest_m = 1;
  for (const Candidate& candidate : by_outlines->candidates)
    nearest_m = std::min(nearest_m, (candidate.position_m - pose.origin_in_source()).norm());
  EXPECT_LT(nearest_m, 0.02);
}

TEST(Locate, LampsThatAreNotOnTheMapGiveNoPose) {
  const Scene seen = irregular_room();
  Scene map = seen;
  for (std::size_t i = 0; i < map.lamps.size(); ++i) {  // another room altogether
    map.lamps[i].centre_m += Eigen::Vector3d(0.37 * std::cos(9.0 * static_cast<double>(i)),
                                             0.41 * std::sin(5.0 * static_cast<double>(i * i)), 0);
  }
  Random random(7);
  const Result<Fix> fix = locate(simulate(seen, random_room_pose(random)).image.view(), map);
  EXPECT_NE(fix.status, Status::ok);
}

TEST(Locate, HalfTheLampsSwitchedOffAreNotMissed) {
  const Scene map = irregular_room();
  Scene lit = map;
  lit.lamps = {map.lamps[1], map.lamps[3], map.lamps[4]};
  Random random(8);
  for (int trial = 0; trial < 10; ++trial) {
    const Rigid3 truth = pose_with_lamps(random, lit, 3);
    const Result<Fix> fix = locate(simulate(lit, truth).image.view(), map);
    ASSERT_EQ(fix.status, Status::ok) << "trial " << trial << ": " << fix.message;
    EXPECT_LT(position_error_m(*fix, truth), 3e-3) << "trial " << trial;
  }
}

/// Right, or not said to be: no fix that claims to be the one is further off than it says.
void expect_not_silently_wrong(const Result<Fix>& fix, const Rigid3& truth, int trial) {
  if (!fix.ok()) return;
  const double sigma_m = std::sqrt(fix->position_covariance_m2.trace());
  EXPECT_LT(position_error_m(*fix, truth), std::max(5e-3, 5 * sigma_m))
      << "trial " << trial << ", chi2 " << fix->candidates.front().chi2 << " of "
      << fix->candidates.front().dof;
}

TEST(Locate, AHalfCoveredViewIsNeverSilentlyWrong) {
  const Scene scene = irregular_room();
  Random random(9);
  int solved = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const Rigid3 truth = random_room_pose(random);
    Image image = simulate(scene, truth).image;
    const auto edge = static_cast<std::ptrdiff_t>(random.uniform(200, 440));
    for (int y = 0; y < image.height; ++y) {
      const auto row = image.u8.begin() + static_cast<std::ptrdiff_t>(y) * image.width;
      std::fill(row, row + edge, image.u8.front());
    }
    const Result<Fix> fix = locate(image.view(), scene);
    expect_not_silently_wrong(fix, truth, trial);
    solved += fix.ok();
  }
  EXPECT_GT(solved, 30);
}

Scene with_lamps_moved(Scene scene, Random& random) {
  for (Lamp& lamp : scene.lamps)
    lamp.centre_m += Eigen::Vector3d(0.4 * random.normal(), 0.4 * random.normal(), 0);
  return scene;
}

TEST(Locate, AMapOfAnotherRoomIsNeverSilentlyWrong) {
  const Scene map = irregular_room();
  Random random(10);
  for (int trial = 0; trial < 100; ++trial) {
    const Scene seen = with_lamps_moved(map, random);
    const Result<Fix> fix = locate(simulate(seen, random_room_pose(random)).image.view(), map);
    EXPECT_NE(fix.status, Status::ok) << "trial " << trial;
    EXPECT_FALSE(fix.message.empty()) << "trial " << trial;
  }
}

// Points have no size that could speak against a pose.
TEST(Locate, AMapOfOtherPointsIsNeverSilentlyWrong) {
  Scene map = irregular_room();
  for (Lamp& lamp : map.lamps) {
    lamp.shape = LampShape::point;
    lamp.power_w = 0.03;
  }
  Random random(11);
  for (int trial = 0; trial < 300; ++trial) {
    const Scene seen = with_lamps_moved(map, random);
    const Result<Fix> fix = locate(simulate(seen, random_room_pose(random)).image.view(), map);
    EXPECT_NE(fix.status, Status::ok) << "trial " << trial;
  }
}

TEST(Locate, RefusesAnImageOfAnotherSizeThanTheCameras) {
  const Image image = constant_image(320, 240, 0);
  try {
    locate(image.view(), irregular_room());
    FAIL() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("640 x 480"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("320 x 240"), std::string::npos) << error.what();
  }
}

TEST(Locate, NamesPixelsThatAreDeeperThanTheSensors) {
  Scene scene = irregular_room();
  Random random(5);
  Image image = simulate(scene, pose_with_lamps(random, scene, 4)).image;
  image.type = PixelType::u16;
  for (const std::uint8_t level : image.u8)
    image.u16.push_back(static_cast<std::uint16_t>(257 * level));
  image.u8.clear();
  const Result<Fix> shallow = locate(image.view(), scene);
  EXPECT_NE(shallow.message.find("sensor.bit_depth = 8"), std::string::npos) << shallow.message;
  scene.sensor.bit_depth = 16;
  const Result<Fix> deep = locate(image.view(), scene);
  EXPECT_EQ(deep.message.find("bit_depth"), std::string::npos) << deep.message;
}

TEST(Locate, RefusesAnInvalidScene) {
  const Image image = constant_image(640, 480, 0);
  Scene scene = irregular_room();
  scene.lamps[1].id = scene.lamps[0].id;
  EXPECT_THROW(locate(image.view(), scene), std::invalid_argument);
  scene = irregular_room();
  scene.lamps[2].radius_m = -0.1;
  EXPECT_THROW(locate(image.view(), scene), std::invalid_argument);
}

TEST(Locate, RefusesBadOptions) {
  const Image image = constant_image(640, 480, 0);
  LocateOptions options;
  options.max_candidates = 0;
  EXPECT_THROW(locate(image.view(), irregular_room(), options), std::invalid_argument);
}

TEST(Locate, RefusesAPriorInTheOptionsOfAStep) {
  const Image image = constant_image(640, 480, 0);
  LocateOptions of_identify, of_refine;
  of_identify.identify.prior.emplace();
  of_refine.refine.prior.emplace();
  for (const LocateOptions& options : {of_identify, of_refine}) {
    try {
      locate(image.view(), irregular_room(), options);
      ADD_FAILURE() << "accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find("LocateOptions::prior"), std::string::npos)
          << error.what();
    }
  }
}

}  // namespace
}  // namespace occ
