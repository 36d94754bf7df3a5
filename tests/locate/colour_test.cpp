// SPDX-License-Identifier: Apache-2.0
// Coloured lamps among white ones that are not in the map, in rendered colour images.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "libocc/locate/locate.hpp"
#include "tests/support/colour_images.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

const Eigen::Vector3d green(0.05, 1, 0.6), red(1, 0.1, 0.05);

Scene coloured_room() {
  Scene scene = test::irregular_room();
  scene.sensor.response = Response::linear;
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) scene.lamps[i].colour = i < 3 ? green : red;
  return scene;
}

/// The room with a white lamp beside each coloured one and white light from elsewhere. At a
/// distance of less than two radii the lamps overlap in the image.
Scene as_built(Scene scene, Random& random, double radii = 1.7) {
  const std::vector<Lamp> mapped = scene.lamps;
  for (const Lamp& lamp : mapped) {
    Lamp light = lamp;
    light.id = 100 + lamp.id;
    light.colour.setOnes();
    const double angle = random.uniform(-3, 3);
    light.centre_m += radii * lamp.radius_m * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
    light.centre_m.z() += 0.01;
    scene.lamps.push_back(light);
  }
  scene.ambient_w_m2 = 0.02;
  return scene;
}

Rigid3 central_pose(Random& random) {
  return look_at({random.uniform(1.8, 2.2), random.uniform(1.8, 2.2), random.uniform(0.2, 0.5)},
                 {2, 2, 3}, {random.uniform(-1, 1), 1, 0});
}

double error_m(const Fix& fix, const Rigid3& truth) {
  return (fix.position_m - truth.origin_in_source()).norm();
}

TEST(LocateColour, WhiteLightsDoNotDisturb) {
  const Scene scene = coloured_room();
  Random random(1);
  for (int trial = 0; trial < 5; ++trial) {
    const Scene built = as_built(scene, random);
    const Rigid3 truth = central_pose(random);
    SimulateOptions options;
    options.seed = static_cast<std::uint64_t>(trial);
    const Image image = test::simulate_colours(built, truth, options).image;
    const Result<Fix> fix = locate(image.view(), scene);
    ASSERT_TRUE(fix.ok()) << fix.message;
    EXPECT_LT(error_m(*fix, truth), 2e-3);
    EXPECT_EQ(fix->lamps.size(), scene.lamps.size());

    const Image grey = to_grey(image.view());
    const Result<Fix> without = locate(grey.view(), scene);
    EXPECT_FALSE(without.ok() && error_m(*without, truth) < 2e-3);
  }
}

// Twice to ten times the exposure clips one, two or three channels.
TEST(LocateColour, ClippedChannelsKeepTheColour) {
  Scene scene = coloured_room();
  Random random(2);
  for (const double exposure : {2, 4, 10}) {
    Scene bright = scene;
    bright.sensor.exposure_s *= exposure;
    const Scene built = as_built(bright, random, 2.3);
    const Rigid3 truth = central_pose(random);
    const Image image = test::simulate_colours(built, truth).image;
    const Result<Fix> fix = locate(image.view(), bright);
    ASSERT_TRUE(fix.ok()) << exposure << ": " << fix.message;
    EXPECT_LT(error_m(*fix, truth), 0.03) << exposure;
    EXPECT_GE(fix->lamps.size(), scene.lamps.size() - 1) << exposure;
  }
}

TEST(LocateColour, AGreyImageWorksAsBeforeAndIsReported) {
  const Scene scene = coloured_room(), plain = test::irregular_room();
  Random random(3);
  const Rigid3 truth = central_pose(random);
  const Image image = simulate(plain, truth).image;
  const Result<Fix> fix = locate(image.view(), scene), before = locate(image.view(), plain);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_EQ(fix->position_m, before->position_m);
  EXPECT_EQ(before.message, "");
  EXPECT_NE(fix.message.find("colours of the lamps were not compared"), std::string::npos);
}

// Without stated colours a colour image is read as grey, whatever its colours.
TEST(LocateColour, ASceneWithoutColoursReadsGrey) {
  Random random(4);
  const Rigid3 truth = central_pose(random);
  const Image image = test::simulate_colours(coloured_room(), truth).image;
  Scene plain = test::irregular_room();
  plain.sensor.response = Response::linear;
  const Result<Fix> fix = locate(image.view(), plain);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_LT(error_m(*fix, truth), 2e-3);
  EXPECT_EQ(fix.message, "");
}

// Pictures with three colours of 8 bits are sRGB, unless the sensor says otherwise.
// Green lamps that white ones overlap, on a map that states no colours.
TEST(LocateColour, ColoursThatTheSceneLacksAreFoundInTheImage) {
  Scene scene = coloured_room();
  for (Lamp& lamp : scene.lamps) lamp.colour = green;
  Scene map = scene;
  for (Lamp& lamp : map.lamps) lamp.colour.setOnes();
  Random random(1);
  for (int trial = 0; trial < 3; ++trial) {
    const Scene built = as_built(scene, random);
    const Rigid3 truth = central_pose(random);
    const Image image = test::simulate_colours(built, truth, {}).image;
    const Result<Fix> fix = locate(image.view(), map);
    ASSERT_TRUE(fix.ok()) << fix.message;
    EXPECT_LT(error_m(*fix, truth), 2e-3);
    ASSERT_TRUE(fix->found_colour);
    EXPECT_LT((*fix->found_colour - green).norm(), 0.2) << fix->found_colour->transpose();
    EXPECT_NE(fix.message.find("the scene states no colours"), std::string::npos) << fix.message;
    // White lamps, and green ones without other lights, need none.
    const Image plain = test::simulate_colours(trial == 0 ? map : scene, truth, {}).image;
    const Result<Fix> same = locate(plain.view(), map);
    ASSERT_TRUE(same.ok()) << same.message;
    EXPECT_FALSE(same->found_colour);
  }
}

TEST(LocateColour, ColourPicturesAreSrgb) {
  Random random(4);
  const Rigid3 truth = central_pose(random);
  Scene scene = test::irregular_room(), linear = scene;
  linear.sensor.response = Response::linear;
  Image image = test::simulate_colours(scene, truth).image;
  Sensor coded = scene.sensor;
  coded.response = Response::srgb;
  for (std::uint8_t& value : image.u8) {
    const double electrons = std::max(0.0, value - coded.black_level_dn) / coded.gain_dn_per_e;
    value = static_cast<std::uint8_t>(std::lround(coded.grey_level(electrons)));
  }
  const Result<Fix> fix = locate(image.view(), scene);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_LT(error_m(*fix, truth), 1e-3);
  EXPECT_EQ(fix.message, "");
  scene.sensor.response = Response::srgb;
  EXPECT_EQ(locate(image.view(), scene)->cam_from_world.matrix(), fix->cam_from_world.matrix());
  const Result<Fix> as_linear = locate(image.view(), linear);
  ASSERT_FALSE(as_linear->candidates.empty());
  EXPECT_GT(as_linear->candidates[0].variance_factor, 4);
}

// Stripes are read in the colour difference, too. Their blobs have no colour.
TEST(LocateColour, CodedLampsAreNamedThroughARollingShutter) {
  Scene scene = test::square_room();
  scene.sensor.response = Response::linear;
  const double codes_hz[] = {2000, 2500, 3000, 3500};
  for (std::size_t i = 0; i < 4; ++i) {
    scene.lamps[i].frequency_hz = codes_hz[i];
    scene.lamps[i].radius_m = 0.17;
    scene.lamps[i].colour = green;
  }
  scene.camera = Camera::pinhole(1280, 960, 845, 845, 639.5, 479.5);
  scene.sensor.row_time_s = 1 / 47540.0;
  scene.sensor.exposure_s = 6e-5;
  Random random(5);
  const Rigid3 truth = central_pose(random);
  const Image image = test::simulate_colours(scene, truth).image;
  const Result<Fix> fix = locate(image.view(), scene);
  ASSERT_TRUE(fix.ok()) << fix.message;
  EXPECT_EQ(fix->lamps.size(), 4u);
  EXPECT_LT(error_m(*fix, truth), 0.01);
}

}  // namespace
}  // namespace occ
