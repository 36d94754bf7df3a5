// SPDX-License-Identifier: Apache-2.0
// The renderer's mean image, compared with sums over point sources, and the truth of each lamp.
#include "libocc/simulate/simulate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "tests/support/quadrature.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

// Image of a round lamp divided into small point lamps that share its power.
Eigen::MatrixXd sum_over_elements(const Lamp& disc, const Scene& scene, const Rigid3& pose) {
  Eigen::MatrixXd image = Eigen::MatrixXd::Zero(scene.camera.width(), scene.camera.height());
  const Eigen::Vector3d across = disc.x_axis, along = disc.normal.cross(across);
  const int around = 96;
  for (const Eigen::Vector2d& ring : quadrature(12))
    for (int i = 0; i < around; ++i) {
      const double radius = disc.radius_m * (ring.x() + 0.5), angle = 2 * pi * i / around;
      Lamp element = disc;
      element.shape = LampShape::point;
      element.centre_m += radius * (std::cos(angle) * across + std::sin(angle) * along);
      element.power_w *= ring.y() * 2 * (ring.x() + 0.5) / around;
      add_dot(image, *scene.camera.project(pose * element.centre_m), scene.sensor.psf_sigma_px,
              lamp_electrons(element, pose, scene.camera, scene.sensor));
    }
  return image;
}

// Largest difference between the rendered image of the scene's only disc and the sum over its
// elements, relative to the peak. The rendered lamp may have another radius.
double worst_error(Scene scene, const Rigid3& pose, double radius_factor = 1) {
  scene.validate();
  const Eigen::MatrixXd truth = sum_over_elements(scene.lamps[0], scene, pose);
  scene.lamps[0].radius_m *= radius_factor;
  const Eigen::MatrixXd image = mean_electrons(scene, pose, truth.maxCoeff());
  return (image - truth).cwiseAbs().maxCoeff() / truth.maxCoeff();
}

Scene small_scene(const std::vector<double>& distortion = {}) {
  Scene scene;
  scene.camera = Camera::pinhole(64, 48, 200, 200, 31.5, 23.5, distortion);
  scene.lamps = {disc_lamp(0, {0, 0, 1.5})};
  scene.lamps[0].half_power_rad = 1.2217;  // 70 degrees: radiance increases off axis
  return scene;
}

// A camera that sees the point (0, 0, 1.5), `tilt_rad` away from its axis.
Rigid3 tilted(double tilt_rad) {
  const Eigen::Vector3d eye(1.5 * std::tan(0.6), 0, 0);
  const Eigen::Vector3d target =
      Eigen::Vector3d(0, 0, 1.5) + tilt_rad * Eigen::Vector3d(0.4, 1.5, 0);
  return look_at(eye, target, Eigen::Vector3d::UnitY());
}

TEST(ExpectedImage, IsTheSumOverTheLampsElements) {
  EXPECT_LT(worst_error(small_scene(), tilted(0.05)), 3e-5);
  EXPECT_LT(worst_error(small_scene({-0.3, 0.1, 0.003, -0.002}), tilted(0.05)), 3e-5);
  Scene narrow = small_scene();
  narrow.lamps[0].half_power_rad = 0.5;
  narrow.sensor.psf_sigma_px = 1.2;
  EXPECT_LT(worst_error(narrow, tilted(0.05)), 5e-5);
  Scene small = small_scene();
  small.lamps[0].radius_m = 0.005;
  EXPECT_LT(worst_error(small, tilted(0.05)), 1e-4);
}

TEST(ExpectedImage, TheComparisonDetectsARadiusErrorOfOneInTenThousand) {
  EXPECT_GT(worst_error(small_scene(), tilted(0.05), 1.0002), 3e-4);
}

TEST(ExpectedImage, OfAGrazingLampIsTheSumOverItsElements) {
  // A wall lamp seen 80 degrees off its normal; its radiance increases towards grazing angles.
  Scene scene = small_scene();
  scene.lamps[0].normal = -Eigen::Vector3d(std::sin(0.8), 0, std::cos(0.8)).normalized();
  EXPECT_LT(worst_error(scene, tilted(0.05)), 1e-4);
}

TEST(ExpectedImage, OfAPointLampHoldsItsElectrons) {
  Scene scene = small_scene();
  scene.lamps[0].shape = LampShape::point;
  const double electrons = lamp_electrons(scene.lamps[0], tilted(0.05), scene.camera, scene.sensor);
  const Eigen::MatrixXd image = mean_electrons(scene, tilted(0.05), electrons);
  EXPECT_NEAR(image.sum() / electrons, 1, 2e-4);
  EXPECT_NEAR(simulate(scene, tilted(0.05)).lamps[0].electrons / electrons, 1, 1e-7);
}

TEST(ExpectedImage, OfATinyDiscEqualsThatOfAPoint) {
  Scene disc = small_scene();
  disc.lamps[0].radius_m = 2e-5;
  Scene point = disc;
  point.lamps[0].shape = LampShape::point;
  const double peak = mean_electrons(point, tilted(0.05), 1e7).maxCoeff();
  const Eigen::MatrixXd difference =
      mean_electrons(disc, tilted(0.05), peak) - mean_electrons(point, tilted(0.05), peak);
  EXPECT_LT(difference.cwiseAbs().maxCoeff() / peak, 1e-4);
}

TEST(ExpectedImage, OfARectangleHasItsFlux) {
  Scene scene = small_scene();
  Lamp& lamp = scene.lamps[0];
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {0.05, 0.02};
  lamp.x_axis = Eigen::Vector3d(1, 1, 0);
  const Rendered rendered = simulate(scene, tilted(0.05));
  EXPECT_NEAR(
      rendered.lamps[0].electrons / lamp_electrons(lamp, tilted(0.05), scene.camera, scene.sensor),
      1, 2e-3);
}

TEST(ExpectedImage, LampsAdd) {
  Scene both = small_scene();
  both.lamps.push_back(disc_lamp(1, {0.03, 0.02, 1.5}));
  Scene first = both, second = both;
  first.lamps.pop_back();
  second.lamps.erase(second.lamps.begin());
  const double peak = mean_electrons(both, tilted(0.05), 1e5).maxCoeff();
  const Eigen::MatrixXd sum =
      mean_electrons(first, tilted(0.05), peak) + mean_electrons(second, tilted(0.05), peak);
  EXPECT_LT((mean_electrons(both, tilted(0.05), peak) - sum).cwiseAbs().maxCoeff() / peak, 4e-5);
}

TEST(ExpectedImage, RimSpacingSetsTheAccuracy) {
  Scene scene = small_scene();
  SimulateOptions fine, coarse;
  fine.spacing_sigma = 0.5;
  coarse.spacing_sigma = 2;
  const double peak = mean_electrons(scene, tilted(0.05), 1e5).maxCoeff();
  const auto off = [&](const SimulateOptions& options) {
    const Eigen::MatrixXd difference = mean_electrons(scene, tilted(0.05), peak, options) -
                                       mean_electrons(scene, tilted(0.05), peak, fine);
    return difference.cwiseAbs().maxCoeff() / peak;
  };
  EXPECT_LT(off({}), 2e-5);
  EXPECT_GT(off(coarse), 1e-4);
}

TEST(GreyLevels, SaturateAtTheFullWell) {
  Scene scene = small_scene();
  scene.sensor.exposure_s *= 50;
  const Rendered rendered = simulate(scene, tilted(0.05), noiseless());
  const int brightest = *std::max_element(rendered.image.u8.begin(), rendered.image.u8.end());
  EXPECT_EQ(brightest, std::lround(scene.sensor.grey_level(scene.sensor.full_well_e)));
  EXPECT_GT(std::count(rendered.image.u8.begin(), rendered.image.u8.end(), brightest), 100);

  scene.sensor.gain_dn_per_e *= 2;  // so that the converter clips first
  const Rendered clipped = simulate(scene, tilted(0.05), noiseless());
  EXPECT_EQ(*std::max_element(clipped.image.u8.begin(), clipped.image.u8.end()), 255);
}

TEST(GreyLevels, FollowTheResponse) {
  Scene scene = small_scene();
  scene.sensor.black_level_dn = 5;
  const Eigen::MatrixXd electrons = mean_electrons(scene, tilted(0.05), 2e4);
  for (const Response response :
       {Response::linear, Response::gamma, Response::srgb, Response::table}) {
    Sensor& sensor = scene.sensor;
    sensor.response = response;
    if (response == Response::table) sensor.response_table = {0, 0.5, 0.8, 1};
    const Rendered rendered = simulate(scene, tilted(0.05), noiseless());
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x) {
        // The reference image is rounded to 1/60000 of its peak, so neighbouring levels are
        // allowed.
        const double step = 2e4 / 60000;
        const int level = rendered.image.u8[y * 64 + x];
        EXPECT_GE(level, std::lround(sensor.grey_level(electrons(x, y) - step)));
        EXPECT_LE(level, std::lround(sensor.grey_level(electrons(x, y) + step)));
      }
  }
}

TEST(GreyLevels, DeeperThanEightBitsAreSixteenBitImages) {
  Scene scene = small_scene();
  EXPECT_EQ(simulate(scene, tilted(0.05)).image.type, PixelType::u8);
  scene.sensor.bit_depth = 12;
  scene.sensor.gain_dn_per_e *= 16;
  const Rendered rendered = simulate(scene, tilted(0.05));
  EXPECT_EQ(rendered.image.type, PixelType::u16);
  EXPECT_EQ(rendered.image.u16.size(), 64u * 48u);
  EXPECT_TRUE(rendered.image.u8.empty());
  EXPECT_GT(*std::max_element(rendered.image.u16.begin(), rendered.image.u16.end()), 300);
  EXPECT_EQ(rendered.image.view().width, 64);
}

TEST(GreyLevels, AnExposureFarBeyondFullWellIsWhite) {
  Scene scene = small_scene();
  scene.sensor.exposure_s = 100;
  const Rendered rendered = simulate(scene, tilted(0.05));
  EXPECT_GE(*std::max_element(rendered.image.u8.begin(), rendered.image.u8.end()), 250);
}

TEST(Truth, OfALampInView) {
  const Scene scene = irregular_room();
  const Rigid3 pose = look_at({2, 2, 0.3}, {2, 2.3, 3}, Eigen::Vector3d::UnitY());
  const Rendered rendered = simulate(scene, pose, noiseless());
  EXPECT_EQ(rendered.cam_from_world.matrix(), pose.matrix());
  ASSERT_EQ(rendered.lamps.size(), scene.lamps.size());
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    const LampTruth& truth = rendered.lamps[i];
    EXPECT_EQ(truth.id, scene.lamps[i].id);
    ASSERT_TRUE(truth.in_view);
    EXPECT_TRUE(truth.whole);
    EXPECT_EQ(truth.centre_px, *scene.camera.project(pose * scene.lamps[i].centre_m));
    EXPECT_GT((truth.image_centre_px - truth.centre_px).norm(), 1e-3);
    ASSERT_GE(truth.rim_px.size(), 32u);
    Eigen::Vector2d middle = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& px : truth.rim_px) middle += px / double(truth.rim_px.size());
    EXPECT_LT((middle - truth.image_centre_px).norm(), 0.1);
    EXPECT_NEAR(truth.electrons / lamp_electrons(scene.lamps[i], pose, scene.camera, scene.sensor),
                1, 3e-3);
  }
}

TEST(Truth, OfALampCutByTheBorder) {
  Scene scene = small_scene();
  const Rigid3 centred = tilted(0);
  const double whole = simulate(scene, centred).lamps[0].electrons;
  const Eigen::Vector2d centre = simulate(scene, centred).lamps[0].centre_px;
  scene.camera = Camera::pinhole(64, 48, 200, 200, 31.5 - centre.x() - 0.5, 23.5);
  const LampTruth truth = simulate(scene, centred).lamps[0];
  EXPECT_NEAR(truth.centre_px.x(), -0.5, 1e-9);
  EXPECT_TRUE(truth.in_view);
  EXPECT_FALSE(truth.whole);
  EXPECT_NEAR(truth.electrons / whole, 0.5, 0.02);
}

TEST(Truth, OfALampThatFillsTheImage) {
  Scene scene = small_scene();
  scene.lamps[0].radius_m = 1;
  const LampTruth truth = simulate(scene, tilted(0)).lamps[0];
  EXPECT_TRUE(truth.in_view);
  EXPECT_FALSE(truth.whole);
  EXPECT_FALSE(truth.rim_px.empty());
}

TEST(Truth, OfLampsOutOfView) {
  Scene scene = small_scene();
  scene.lamps = {disc_lamp(0, {30, 0, 1.5}),                    // beside the image
                 disc_lamp(1, {0.9, 0, -3}),                    // behind the camera
                 disc_lamp(2, {1.5 * std::tan(0.6), 0, 0.01}),  // the camera is inside its rim
                 disc_lamp(3, {0, 0, 1.5})};
  scene.lamps[3].normal = Eigen::Vector3d::UnitZ();  // its dark side is visible
  const Rendered rendered = simulate(scene, tilted(0), noiseless());
  for (const LampTruth& truth : rendered.lamps) {
    EXPECT_FALSE(truth.in_view) << truth.id;
    EXPECT_FALSE(truth.whole) << truth.id;
    EXPECT_EQ(truth.electrons, 0) << truth.id;
    EXPECT_TRUE(truth.rim_px.empty()) << truth.id;
  }
  const auto [low, high] = std::minmax_element(rendered.image.u8.begin(), rendered.image.u8.end());
  EXPECT_EQ(*low, 2);
  EXPECT_EQ(*high, 2);
}

TEST(Truth, OfARimThatLeavesTheLensDomain) {
  // With k1 = -0.5 the projection folds back beyond 39 degrees, where half of this lamp's rim is.
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 300, 300, 319.5, 239.5, {-0.5, 0, 0, 0});
  scene.lamps = {disc_lamp(0, {std::tan(scene.camera.max_angle_rad()), 0, 1}, 0.3)};
  EXPECT_FALSE(simulate(scene, Rigid3{}).lamps[0].in_view);
  scene.lamps[0].centre_m.x() -= 0.31;
  EXPECT_TRUE(simulate(scene, Rigid3{}).lamps[0].in_view);
}

TEST(Simulate, AnEmptySceneIsBlack) {
  Scene scene = small_scene();
  scene.lamps.clear();
  const Rendered rendered = simulate(scene, Rigid3{}, noiseless());
  EXPECT_TRUE(rendered.lamps.empty());
  EXPECT_EQ(std::count(rendered.image.u8.begin(), rendered.image.u8.end(), 2), 64 * 48);
}

TEST(Simulate, RejectsInvalidInput) {
  const Scene good = small_scene();
  Scene bad = good;
  bad.lamps[0].radius_m = -1;
  EXPECT_THROW(simulate(bad, Rigid3{}), std::invalid_argument);
  bad = good;
  bad.lamps.push_back(bad.lamps[0]);  // duplicate id
  EXPECT_THROW(simulate(bad, Rigid3{}), std::invalid_argument);
  Rigid3 pose;
  pose.translation.x() = std::nan("");
  EXPECT_THROW(simulate(good, pose), std::invalid_argument);
  pose = Rigid3{};
  pose.rotation *= 1.1;
  EXPECT_THROW(simulate(good, pose), std::invalid_argument);
  for (const double spacing : {0.0, -1.0, 3.0, std::nan("")}) {
    SimulateOptions options;
    options.spacing_sigma = spacing;
    EXPECT_THROW(simulate(good, Rigid3{}, options), std::invalid_argument);
  }
  SimulateOptions options;
  options.start_s = std::numeric_limits<double>::infinity();
  EXPECT_THROW(simulate(good, Rigid3{}, options), std::invalid_argument);
}

}  // namespace
