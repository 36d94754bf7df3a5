// SPDX-License-Identifier: Apache-2.0
// Ambient irradiance from the background of rendered images.
#include "libocc/photometry/ambient.hpp"

#include "libocc/core/random.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// Scene with ambient light a few grey levels above black.
Scene room_with(double ambient_w_m2) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) {
    lamp.radius_m = 0.05;
    lamp.power_w = 0.3;
  }
  scene.sensor.exposure_s = 1e-4;
  scene.sensor.black_level_dn = 4;
  scene.sensor.read_noise_e = 30;
  scene.ambient_w_m2 = ambient_w_m2;
  return scene;
}

std::vector<Rigid3> poses_of(int count, Random& random) {
  std::vector<Rigid3> poses;
  for (int i = 0; i < count; ++i)
    poses.push_back(
        look_at({random.uniform(0.5, 3.5), random.uniform(0.5, 3.5), 0.1}, {2, 2, 3}, {0.1, 1, 0}));
  return poses;
}

Result<AmbientLight> measured(const Scene& truth, const Scene& known, int count,
                              std::uint64_t seed) {
  Random random(seed);
  const std::vector<Rigid3> poses = poses_of(count, random);
  std::vector<Image> images;
  for (const Rigid3& pose : poses) {
    SimulateOptions options;
    options.seed = seed * 100 + images.size();
    images.push_back(simulate(truth, pose, options).image);
  }
  std::vector<ImageView> views;
  for (const Image& image : images) views.push_back(image.view());
  return calibrate_ambient(known, views, poses);
}

Result<AmbientLight> measured(const Scene& truth, int count = 4, std::uint64_t seed = 1) {
  Scene known = truth;
  known.ambient_w_m2 = 0;
  return measured(truth, known, count, seed);
}

double deviation(const Result<AmbientLight>& found, const Scene& truth) {
  return (found->irradiance_w_m2 - truth.ambient_w_m2) / std::sqrt(found->variance_w2_m4);
}

TEST(CalibrateAmbient, RecoversTheTruth) {
  for (const double irradiance : {0.0, 0.004, 0.02}) {
    const Scene truth = room_with(irradiance);
    const auto found = measured(truth);
    ASSERT_TRUE(found.ok()) << found.message;
    EXPECT_TRUE(found.message.empty());
    EXPECT_LT(std::abs(deviation(found, truth)), 4) << irradiance;
    EXPECT_LT(std::sqrt(found->variance_w2_m4), 5e-5);
    EXPECT_EQ(found->dof, 3);
    EXPECT_LT(found->chi2, test::chi2_interval(3, 3.3).second);
  }
}

TEST(CalibrateAmbient, ModelsBlackLevelDarkCurrentGainsAndResponse) {
  Scene truth = room_with(0.02);
  truth.sensor.dark_current_e_per_s = 3e6;
  truth.sensor.gain_sigma = 0.02;
  truth.sensor.response = Response::srgb;
  truth.sensor.bit_depth = 12;
  truth.sensor.gain_dn_per_e = 0.4;
  truth.lens.vignetting = {-0.4};
  const auto found = measured(truth);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_LT(std::abs(deviation(found, truth)), 4);
  EXPECT_LT(std::sqrt(found->variance_w2_m4), 1e-4);
}

/// Squared normalised errors and chi2 over many image series, for several levels of light and
/// noise.
TEST(SlowCalibrateAmbient, VarianceMatchesTheErrors) {
  double squares = 0, chi2 = 0;
  int count = 0, dof = 0;
  for (int run = 0; run < 60; ++run) {
    Scene truth = room_with(0.005 + 0.0007 * run);
    const auto found = measured(truth, 3, 1000 + static_cast<std::uint64_t>(run));
    ASSERT_TRUE(found.ok()) << found.message;
    squares += std::pow(deviation(found, truth), 2);
    chi2 += found->chi2;
    dof += found->dof;
    ++count;
  }
  const auto interval = test::chi2_interval(count), of_chi2 = test::chi2_interval(dof);
  EXPECT_GT(squares, interval.first);
  EXPECT_LT(squares, interval.second);
  EXPECT_GT(chi2, of_chi2.first);
  EXPECT_LT(chi2, of_chi2.second);
}

TEST(CalibrateAmbient, RoundingLimitsTheAccuracyWithoutNoise) {
  Scene truth = room_with(0.02);
  truth.effects.set(Effect::noise, Use::off);
  truth.sensor.read_noise_e = 0;
  double squares = 0;
  for (int run = 0; run < 40; ++run) {
    truth.ambient_w_m2 = 0.01 + 0.0004 * run;
    const auto found = measured(truth, 2);
    ASSERT_TRUE(found.ok());
    squares += std::pow(deviation(found, truth), 2);
    EXPECT_LT(std::abs(deviation(found, truth)), 1.9) << "half a level over its sigma is 1.73";
  }
  EXPECT_GT(squares, 20);
}

TEST(CalibrateAmbient, RejectsAClippedBackground) {
  Scene black = room_with(0.0002);
  black.sensor.black_level_dn = 0;
  const auto dark = measured(black);
  EXPECT_EQ(dark.status, Status::degenerate);
  EXPECT_NE(dark.message.find("of the background is at level 0"), std::string::npos)
      << dark.message;
  EXPECT_TRUE(std::isinf(dark->variance_w2_m4));
  const auto white = measured(room_with(5));
  EXPECT_EQ(white.status, Status::degenerate);
  EXPECT_NE(white.message.find("of the background is saturated"), std::string::npos)
      << white.message;
}

TEST(CalibrateAmbient, RejectsOtherLightInTheBackground) {
  Scene scene = room_with(0.01);
  scene.room = Room{};
  scene.room->wall_reflectance = 0.5;
  EXPECT_NE(measured(scene).message.find("the walls' light cannot be separated"),
            std::string::npos);
  for (const Effect effect : {Effect::walls, Effect::interreflection})
    scene.effects.set(effect, Use::off);
  EXPECT_TRUE(measured(scene).ok());
  scene.lens.veiling_glare = 0.1;
  EXPECT_NE(measured(scene).message.find("glare"), std::string::npos);
  scene.lens = Lens{};
  Scene darker = scene;
  darker.sensor.black_level_dn = 12;
  EXPECT_NE(measured(room_with(0), darker, 2, 1).message.find("darker than the scene's black"),
            std::string::npos);
}

TEST(CalibrateAmbient, ReportsChangingLight) {
  Random random(3);
  const std::vector<Rigid3> poses = poses_of(2, random);
  const Image first = simulate(room_with(0.01), poses[0]).image;
  const Image second = simulate(room_with(0.012), poses[1]).image;
  const auto found = calibrate_ambient(room_with(0), {first.view(), second.view()}, poses);
  EXPECT_TRUE(found.ok());
  EXPECT_GT(found->variance_factor, 100);
  EXPECT_NE(found.message.find("differ by more than their noise allows"), std::string::npos);
}

TEST(CalibrateAmbient, RejectsInvalidInput) {
  Scene scene = room_with(0);
  const Image image = simulate(scene, look_at({2, 2, 0}, {2, 2, 3}, {0, 1, 0})).image;
  Image small = image;
  small.height = 10;
  small.u8.resize(6400);
  const auto error_message = [&](const std::vector<ImageView>& images) {
    return test::complaint([&] { calibrate_ambient(scene, images, {Rigid3{}}); });
  };
  EXPECT_NE(error_message({}).find("one pose for each of 0 images"), std::string::npos);
  EXPECT_NE(
      error_message({small.view()}).find("images[0] must be of the camera's size, got 640x10"),
      std::string::npos);
  scene.sensor.mosaic = Mosaic::rggb;
  EXPECT_NE(error_message({image.view()}).find("sensor.mosaic"), std::string::npos);
  scene.effects.set(Effect::ambient, Use::off);
  EXPECT_NE(error_message({image.view()}).find("effects.ambient"), std::string::npos);
}

}  // namespace
}  // namespace occ
