// SPDX-License-Identifier: Apache-2.0
// Images of lamps with measured emission agree with those of their closed forms.
#include "tests/support/photometry.hpp"

#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/lamp_image.hpp"
#include "libocc/formation/light.hpp"
#include "tests/support/support.hpp"

namespace {

using namespace occ;

Lamp lamp_of(std::shared_ptr<const EmissionProfile> profile, const Eigen::Vector3d& normal) {
  Lamp lamp = test::disc_lamp(0, {0.2, 0.1, 1.5}, 0.085);
  lamp.normal = normal;
  lamp.x_axis = {0.6, 0.8, 0};
  lamp.photometry = std::move(profile);
  lamp.validate();
  return lamp;
}

TEST(Photometry, ACosinePowerGivesTheLightOfALambertianLamp) {
  const Camera camera = test::vga_camera();
  Lamp measured = lamp_of(test::profile_of(test::cosine_power(1.7), 2.5, 0), {0.2, -0.3, -1});
  Lamp lambertian = measured;
  lambertian.photometry = nullptr;
  lambertian.half_power_rad = std::acos(std::exp2(-1 / 1.7));
  for (const double x : {-0.6, 0.0, 0.5}) {
    const Rigid3 pose{Eigen::Matrix3d::Identity(), Eigen::Vector3d(x, 0.2, 0.1)};
    Eigen::Matrix<double, 1, 6> by_pose, expected_by_pose;
    const double electrons = lamp_electrons(measured, pose, camera, Sensor{}, &by_pose);
    const double expected = lamp_electrons(lambertian, pose, camera, Sensor{}, &expected_by_pose);
    EXPECT_NEAR(electrons / expected, 1, 1e-3);
    EXPECT_NEAR((by_pose - expected_by_pose).norm(), 0, 0.01 * expected_by_pose.norm());
    const Eigen::Vector2d px = *camera.project(pose * measured.centre_m);
    EXPECT_NEAR(irradiance_at(measured, pose, camera, Sensor{}, px) /
                    irradiance_at(lambertian, pose, camera, Sensor{}, px),
                1, 1e-3);
  }
}

TEST(Photometry, ABatwingLiesAlongTheLampsAxes) {
  const Camera camera = test::vga_camera();
  const Lamp lamp = lamp_of(test::profile_of(test::batwing, 5, 15), {0.2, -0.3, -1});
  const Eigen::Vector3d c90 = lamp.x_axis.cross(lamp.normal);
  Random random(4);
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector3d position(random.uniform(-1, 1), random.uniform(-1, 1),
                                   random.uniform(-0.3, 0.3));
    const Rigid3 pose{Eigen::Matrix3d::Identity(), -position};
    const Eigen::Vector3d way = position - lamp.centre_m;
    const double distance = way.norm(), cosine = way.dot(lamp.normal) / distance;
    const double c = std::atan2(way.dot(c90), way.dot(lamp.x_axis));
    const double intensity =
        lamp.power_w * test::batwing(std::acos(cosine), c) / test::batwing_flux();
    const Sensor sensor;
    const double power_w =
        intensity * aperture_m2(camera, sensor) * -way.z() / distance / (distance * distance);
    const double expected =
        power_w / (sensor.pixel_pitch_m * sensor.pixel_pitch_m) * sensor.electrons(1);
    EXPECT_NEAR(lamp_electrons(lamp, pose, camera, sensor) / expected, 1, 1e-3);
  }
}

TEST(Photometry, JacobianOfTheLogarithm) {
  const Camera camera = test::vga_camera();
  const Lamp lamp = lamp_of(test::profile_of(test::batwing, 5, 15), {0.2, -0.3, -1});
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const Rigid3 pose = perturb(
        Rigid3{}, 0.2 * Vector6::NullaryExpr([&](Eigen::Index) { return random.normal(); }));
    Eigen::Matrix<double, 1, 6> analytic;
    ASSERT_GT(lamp_electrons(lamp, pose, camera, Sensor{}, &analytic), 0);
    const Eigen::MatrixXd numeric = test::numerical_jacobian(
        [&](const Eigen::VectorXd& delta) {
          const double e = lamp_electrons(lamp, perturb(pose, delta), camera, Sensor{});
          return Eigen::VectorXd::Constant(1, std::log(e));
        },
        Eigen::VectorXd::Zero(6));
    EXPECT_TRUE(test::jacobian_agrees(analytic, numeric, 1e-5));
  }
}

// The sum of the rendered image is the closed form's flux, and the derivative of its light by a
// rotation of the lamp agrees with differences.
TEST(Photometry, RenderedFluxAndItsDerivative) {
  const Camera camera = test::vga_camera();
  const Sensor sensor;
  const Lamp lamp = lamp_of(test::profile_of(test::batwing, 2.5, 7.5), {0.5, -0.3, -1});
  LampImage image;
  const PixelPsf psf(0.8);
  ASSERT_TRUE(render_lamp(lamp, Rigid3{}, camera, sensor, psf, 0.8, image));
  double sum = 0;
  for (const double e : image.electrons) sum += e;
  const Eigen::Vector3d c90 = lamp.x_axis.cross(lamp.normal);
  double expected = 0;
  int points = 0;
  for (double u = -0.99; u < 1; u += 0.02)
    for (double v = -0.99; v < 1; v += 0.02) {
      if (u * u + v * v > 1) continue;
      ++points;
      const Eigen::Vector3d point = lamp.centre_m + 0.085 * (u * lamp.x_axis + v * c90);
      const double distance = point.norm(), cosine = -point.dot(lamp.normal) / distance;
      const double c = std::atan2(-point.dot(c90), -point.dot(lamp.x_axis));
      expected += lamp.power_w * test::batwing(std::acos(cosine), c) / test::batwing_flux() *
                  aperture_m2(camera, sensor) * point.z() / std::pow(distance, 3) /
                  (sensor.pixel_pitch_m * sensor.pixel_pitch_m) * sensor.electrons(1);
    }
  EXPECT_NEAR(sum / (expected / points), 1, 1e-3);

  const Eigen::Vector2d px = *camera.project(lamp.centre_m);
  const auto log_light = [&](const Eigen::Vector3d& turn) {
    Lamp turned = lamp;
    turned.normal = so3_exp(turn) * lamp.normal;
    turned.x_axis = so3_exp(turn) * lamp.x_axis;
    return std::log(irradiance_at(turned, Rigid3{}, camera, sensor, px));
  };
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d step = 1e-5 * Eigen::Vector3d::Unit(axis);
    EXPECT_NEAR((log_light(step) - log_light(-step)) / 2e-5, image.d_log_light[axis], 1e-4);
  }
}

// A disc of 45 degrees across in the image; pixels inside it have the closed form's irradiance.
TEST(Photometry, PixelsOfALargeLampFollowTheTable) {
  const Camera camera = test::vga_camera();
  const Sensor sensor;
  Lamp lamp = lamp_of(test::profile_of(test::batwing, 5, 10), {0, 0, -1});
  lamp.centre_m = {0.3, 0, 1};
  lamp.radius_m = 0.4;
  LampImage image;
  const PixelPsf psf(0.8);
  ASSERT_TRUE(render_lamp(lamp, Rigid3{}, camera, sensor, psf, 0.8, image));
  const double e_per_irradiance = sensor.electrons(1) - sensor.electrons(0);
  double worst = 0;
  int inside = 0;
  for (int y = 0; y < image.height(); y += 3)
    for (int x = 0; x < image.width(); x += 3) {
      const auto i = static_cast<std::size_t>(y * image.width() + x);
      if (image.coverage.moments.c.values[i] < 1 - 1e-9) continue;
      ++inside;
      const Eigen::Vector2d px(image.x0() + x, image.y0() + y);
      const double expected = e_per_irradiance * irradiance_at(lamp, Rigid3{}, camera, sensor, px);
      worst = std::max(worst, std::abs(image.electrons[i] / expected - 1));
    }
  EXPECT_GT(inside, 1000);
  EXPECT_LT(worst, 3e-4);
}

// Directions without light are dark in the image, although the lit side is visible.
TEST(Photometry, DarkDirectionsAreDark) {
  const Camera camera = test::vga_camera();
  Lamp lamp =
      lamp_of(test::profile_of([](double gamma, double) { return gamma > 0.3 ? 0 : 1; }, 2.5, 0),
              {0, 0, -1});
  lamp.centre_m = {0.3, 0, 1};
  lamp.radius_m = 0.4;
  LampImage image;
  ASSERT_TRUE(render_lamp(lamp, Rigid3{}, camera, Sensor{}, PixelPsf(0.8), 0.8, image));
  const Eigen::Vector2d lit = *camera.project({0.1, 0, 1}), dark = *camera.project({0.6, 0, 1});
  const auto at = [&](const Eigen::Vector2d& px) {
    const int x = static_cast<int>(px.x()) - image.x0(), y = static_cast<int>(px.y()) - image.y0();
    return image.electrons[static_cast<std::size_t>(y * image.width() + x)];
  };
  EXPECT_GT(at(lit), 100);
  EXPECT_LT(at(dark), 1e-3);
  Lamp aside = lamp;
  aside.centre_m = {1, 0, 1};
  EXPECT_EQ(lamp_electrons(aside, Rigid3{}, camera, Sensor{}), 0);
}

TEST(Photometry, ALambertianLampKeepsItsAxisAndAMeasuredOneItsGivenAxis) {
  Lamp lamp = test::disc_lamp(0, {0, 0, 1.5}, 0.085);
  lamp.x_axis = {0, 1, 0};
  lamp.photometry = test::profile_of(test::cosine_power(1), 5, 0);
  lamp.validate();
  EXPECT_EQ(lamp.x_axis, Eigen::Vector3d::UnitX());  // it does not matter, so it is normalised
  lamp.x_axis = {0, 1, 0};
  lamp.photometry = test::profile_of(test::batwing, 5, 15);
  lamp.validate();
  EXPECT_EQ(lamp.x_axis, Eigen::Vector3d::UnitY());
  lamp.x_axis = {0, 0, 1};
  EXPECT_NE(test::complaint([&] { lamp.validate(); }).find("x_axis must be not parallel"),
            std::string::npos);
}

}  // namespace
