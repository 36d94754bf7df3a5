// SPDX-License-Identifier: Apache-2.0
// The image of a lamp for refinement equals the renderer's image, and its derivatives agree with
// central differences.
#include <algorithm>
#include <cmath>

#include "libocc/formation/lamp_image.hpp"
#include "libocc/formation/light.hpp"
#include "tests/support/simulate_support.hpp"

namespace occ {
namespace {

Rigid3 pose() { return look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0}); }

Scene one_lamp(LampShape shape, const std::vector<double>& distortion = {}) {
  Scene scene = test::irregular_room();
  scene.camera = Camera::pinhole(640, 480, 422.5, 420, 319.5, 239.5, distortion);
  scene.lamps = {test::disc_lamp(0, {2.8, 2.5, 3})};
  scene.lamps[0].shape = shape;
  scene.lamps[0].size_m = {0.2, 0.12};
  scene.lamps[0].normal = Eigen::Vector3d(0.3, -0.2, -1);
  scene.lamps[0].half_power_rad = 0.9;
  scene.validate();
  return scene;
}

/// Pose after a rotation of the lamp about its centre and a translation of its centre, camera
/// frame.
Rigid3 lamp_moved(const Lamp& lamp, const Vector6& motion) {
  const Eigen::Vector3d centre = pose() * lamp.centre_m;
  const Eigen::Matrix3d turn = so3_exp(motion.head<3>());
  return {turn * pose().rotation, turn * (pose().translation - centre) + centre + motion.tail<3>()};
}

LampImage render(const Scene& scene, const Rigid3& at, double sigma) {
  LampImage image;
  EXPECT_TRUE(render_lamp(scene.lamps[0], at, scene.camera, scene.sensor, PixelPsf(sigma),
                          0.8 * sigma, image));
  return image;
}

constexpr int frame_px = 90;  // size of the frame around the lamp's image

/// Values of a patch in a fixed frame, so that patches of different extent can be compared.
Eigen::VectorXd framed(const Patch& patch, const std::vector<double>& values) {
  constexpr int left = 210, top = 110;
  Eigen::VectorXd all = Eigen::VectorXd::Zero(frame_px * frame_px);
  for (int y = 0; y < patch.height; ++y)
    for (int x = 0; x < patch.width; ++x)
      all[(patch.y0 + y - top) * frame_px + patch.x0 + x - left] = values[y * patch.width + x];
  return all;
}

class LampImages : public ::testing::TestWithParam<LampShape> {};

TEST_P(LampImages, CoverageDerivativesAgreeWithDifferencesAndErrorsAreDetected) {
  for (const std::vector<double>& distortion :
       {std::vector<double>{}, std::vector<double>{-0.2, 0.05, 1e-3, -1e-3}}) {
    const Scene scene = one_lamp(GetParam(), distortion);
    const double sigma = 0.8;
    const auto coverage = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
      const Rigid3 at = lamp_moved(scene.lamps[0], x.head<6>());
      const LampImage image = render(scene, at, sigma * std::exp(x[6]));
      const Patch& c = image.coverage.moments.c;
      return framed(c, c.values);
    };
    const Eigen::MatrixXd numeric =
        test::numerical_jacobian(coverage, Eigen::VectorXd::Zero(7), 1e-4);
    const LampImage image = render(scene, pose(), sigma);
    const Patch& c = image.coverage.moments.c;
    ASSERT_TRUE(c.x0 > 215 && c.y0 > 115 && c.width < 55 && c.height < 55);
    for (std::size_t k = 0; k < 7; ++k) {
      std::vector<double> values;
      for (const auto& row : image.coverage.d) values.push_back(row[k]);
      const Eigen::VectorXd analytic = framed(c, values);
      const auto column = static_cast<Eigen::Index>(k);
      if (GetParam() == LampShape::point && k < 3) {  // a rotation does not change a point
        EXPECT_EQ(analytic.norm(), 0);
        continue;
      }
      // tabulated and trimmed kernels limit the agreement to 1e-3
      EXPECT_TRUE(test::jacobian_agrees(analytic, numeric.col(column), 2e-3)) << k;
      EXPECT_FALSE(test::jacobian_agrees(1.01 * analytic, numeric.col(column), 2e-3)) << k;
    }
  }
}

TEST_P(LampImages, EqualsTheRenderersImage) {
  Scene scene = one_lamp(GetParam());
  scene.lamps[0].power_w = 1;
  const LampImage image = render(scene, pose(), scene.sensor.psf_sigma_px);
  const double peak = *std::max_element(image.electrons.begin(), image.electrons.end());
  SimulateOptions options;
  options.spacing_sigma = 0.8;
  const Eigen::MatrixXd truth = test::mean_electrons(scene, pose(), peak, options);
  double worst = 0;
  for (int y = 0; y < image.height(); ++y)
    for (int x = 0; x < image.width(); ++x) {
      const double here = image.electrons[y * image.width() + x];
      worst = std::max(worst, std::abs(here - truth(image.x0() + x, image.y0() + y)));
    }
  EXPECT_LT(worst, 2e-5 * peak);  // including 0.8e-5 by rounding of grey levels
  const double rounding_e = 0.5 * peak / 60000;
  for (const double electrons : image.electrons) EXPECT_GE(electrons, -rounding_e);
}

TEST_P(LampImages, LightDerivativeAgreesWithDifferences) {
  const Scene scene = one_lamp(GetParam());
  const LampImage image = render(scene, pose(), 0.8);
  const Eigen::Vector2d px = scene.camera.project(pose() * scene.lamps[0].centre_m).value();
  const auto log_light = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    const Rigid3 at = lamp_moved(scene.lamps[0], x);
    const double light = GetParam() == LampShape::point
                             ? lamp_electrons(scene.lamps[0], at, scene.camera, scene.sensor)
                             : irradiance_at(scene.lamps[0], at, scene.camera, scene.sensor, px);
    return Eigen::VectorXd::Constant(1, std::log(light));
  };
  const Eigen::MatrixXd numeric = test::numerical_jacobian(log_light, Eigen::VectorXd::Zero(6));
  EXPECT_TRUE(test::jacobian_agrees(image.d_log_light.transpose(), numeric));
  EXPECT_FALSE(test::jacobian_agrees(-image.d_log_light.transpose(), numeric));
}

INSTANTIATE_TEST_SUITE_P(Shapes, LampImages,
                         ::testing::Values(LampShape::disc, LampShape::rectangle,
                                           LampShape::point));

TEST(LampImage, IsNotRenderedFromTheDarkSide) {
  Scene scene = one_lamp(LampShape::disc);
  scene.lamps[0].normal *= -1;
  LampImage image;
  EXPECT_FALSE(
      render_lamp(scene.lamps[0], pose(), scene.camera, scene.sensor, PixelPsf(0.8), 0.8, image));
  scene.lamps[0].shape = LampShape::point;
  EXPECT_FALSE(
      render_lamp(scene.lamps[0], pose(), scene.camera, scene.sensor, PixelPsf(0.8), 0.8, image));
}

}  // namespace
}  // namespace occ
