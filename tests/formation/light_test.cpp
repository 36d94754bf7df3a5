// SPDX-License-Identifier: Apache-2.0
// Radiometry of a lamp's image: the aperture formula, the camera equation, and their agreement.
#include "libocc/formation/light.hpp"

#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "tests/support/support.hpp"

namespace {

using namespace occ;

// Lamp of the conference contribution, 1.5 m above an upright camera: 170 mm, 70 degrees, 1500 mW.
Lamp contribution_lamp() {
  Lamp lamp = test::disc_lamp(0, {0, 0, 1.5}, 0.085);
  lamp.half_power_rad = 70 * pi / 180;
  return lamp;
}

Camera camera_of_focal_length(double f_m, double pitch_m = 7.1e-6) {
  return Camera::pinhole(640, 480, f_m / pitch_m, f_m / pitch_m, 319.5, 239.5);
}

double watts(double electrons, const Sensor& sensor) {
  const double pixel_m2 = sensor.pixel_pitch_m * sensor.pixel_pitch_m;
  return electrons / (sensor.electrons(1) - sensor.electrons(0)) * pixel_m2;
}

TEST(LampElectrons, PowerThroughTheLensHasTheKnownValues) {
  const auto dbm = [](double f_m) {
    return 10 * std::log10(1000 * watts(lamp_electrons(contribution_lamp(), Rigid3{},
                                                       camera_of_focal_length(f_m), Sensor{}),
                                        Sensor{}));
  };
  EXPECT_NEAR(dbm(0.0014), -41.73, 0.005);
  EXPECT_NEAR(dbm(0.003), -35.11, 0.005);
}

TEST(LampElectrons, DarkCurrentIsNotLight) {
  Sensor dark;
  dark.dark_current_e_per_s = 1e6;
  const Camera camera = test::vga_camera();
  EXPECT_NEAR(lamp_electrons(contribution_lamp(), Rigid3{}, camera, dark) /
                  lamp_electrons(contribution_lamp(), Rigid3{}, camera, Sensor{}),
              1, 1e-9);
}

TEST(LampElectrons, AreZeroForADarkSideOrBehindTheCamera) {
  Lamp lamp = contribution_lamp();
  const Camera camera = test::vga_camera();
  Eigen::Matrix<double, 1, 6> jacobian;
  EXPECT_GT(lamp_electrons(lamp, Rigid3{}, camera, Sensor{}, &jacobian), 0);
  EXPECT_GT(jacobian.norm(), 0);
  lamp.normal = Eigen::Vector3d::UnitZ();
  EXPECT_EQ(lamp_electrons(lamp, Rigid3{}, camera, Sensor{}, &jacobian), 0);
  EXPECT_EQ(jacobian.norm(), 0);
  lamp.centre_m.z() = -1.5;  // behind, facing the camera
  EXPECT_EQ(lamp_electrons(lamp, Rigid3{}, camera, Sensor{}), 0);
}

TEST(LampElectrons, JacobianOfTheLogarithm) {
  const Camera camera = test::vga_camera();
  Random random(5);
  for (const LampShape shape : {LampShape::disc, LampShape::point}) {
    Lamp lamp = contribution_lamp();
    lamp.shape = shape;
    lamp.normal = Eigen::Vector3d(0.2, -0.3, -1).normalized();
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
      EXPECT_TRUE(test::jacobian_agrees(analytic, numeric));
      analytic[4] *= 1.001;  // the check must detect this
      EXPECT_FALSE(test::jacobian_agrees(analytic, numeric));
    }
  }
}

TEST(Irradiance, OnAxisIsTheCameraEquation) {
  const double on_axis =
      radiance(1.5, contribution_lamp().order(), contribution_lamp().area_m2(), 1);
  EXPECT_NEAR(on_axis, 17.313, 5e-4);
  EXPECT_NEAR(irradiance_at(contribution_lamp(), Rigid3{}, camera_of_focal_length(0.003), Sensor{},
                            {319.5, 239.5}),
              pi / 4 / 4 * on_axis, 1e-12);
}

TEST(Irradiance, DecreasesWithTheFourthPowerOfTheCosineOffAxis) {
  Lamp lamp =
      test::disc_lamp(0, {0, 0, 1.5}, 0.4);  // 60 degrees: the same radiance in all directions
  const Camera camera = test::vga_camera();
  const double on_axis = irradiance_at(lamp, Rigid3{}, camera, Sensor{}, {319.5, 239.5});
  for (const double px : {50.0, 200.0, 400.0}) {
    const double cosine = std::cos(std::atan(px / 500));
    EXPECT_NEAR(irradiance_at(lamp, Rigid3{}, camera, Sensor{}, {319.5 + px, 239.5}) / on_axis,
                std::pow(cosine, 4), 1e-12);
    // The radiance of a lamp of 70 degrees increases off axis, by cos^(m-1) of the emission angle.
    lamp.half_power_rad = 70 * pi / 180;
    EXPECT_NEAR(irradiance_at(lamp, Rigid3{}, camera, Sensor{}, {319.5 + px, 239.5}) /
                    irradiance_at(lamp, Rigid3{}, camera, Sensor{}, {319.5, 239.5}),
                std::pow(cosine, 4 + lamp.order() - 1), 1e-12);
    lamp.half_power_rad = pi / 3;
  }
}

TEST(Irradiance, IsZeroWhereTheRayMissesTheLitSide) {
  Lamp lamp = test::disc_lamp(0, {0, 0, 1.5}, 0.4);
  const Camera camera = test::vga_camera();
  lamp.normal = Eigen::Vector3d::UnitZ();
  EXPECT_EQ(irradiance_at(lamp, Rigid3{}, camera, Sensor{}, {319.5, 239.5}), 0);
  lamp.normal =
      -Eigen::Vector3d::UnitX();  // a wall lamp to the right; its plane is visible only there
  lamp.centre_m = {1, 0, 1.5};
  EXPECT_GT(irradiance_at(lamp, Rigid3{}, camera, Sensor{}, {600, 239.5}), 0);
  EXPECT_EQ(irradiance_at(lamp, Rigid3{}, camera, Sensor{}, {100, 239.5}), 0);
  lamp.shape = LampShape::point;
  EXPECT_THROW(irradiance_at(lamp, Rigid3{}, camera, Sensor{}, {600, 239.5}),
               std::invalid_argument);
}

// Electrons of the lamp's image summed over pixels, relative to the aperture formula.
double flux_ratio(Lamp lamp, const Rigid3& pose, const Camera& camera) {
  const Sensor sensor;
  const Patch patch = coverage(*project_contour(lamp, pose, camera, 0.8), PixelPsf(0.8),
                               camera.width(), camera.height());
  double sum = 0;
  for (int y = patch.y0; y < patch.y0 + patch.height; ++y)
    for (int x = patch.x0; x < patch.x0 + patch.width; ++x)
      sum += patch.at(x, y) * irradiance_at(lamp, pose, camera, sensor, Eigen::Vector2d(x, y)) *
             sensor.electrons(1);
  return sum / lamp_electrons(lamp, pose, camera, sensor);
}

TEST(Flux, SummedIrradianceIsTheAperturePowerAsTheLampShrinks) {
  const Rigid3 pose{so3_exp({0.3, -0.35, 0.8}), {0.2, -0.1, 0.1}};
  const std::vector<Camera> cameras = {
      Camera::pinhole(1400, 1400, 500, 500, 699.5, 699.5),
      Camera::pinhole(1400, 1400, 500, 430, 699.5, 699.5, {}, 3.0),
      Camera::pinhole(1400, 1400, 400, 400, 699.5, 699.5, {-0.25, 0.06, 0.001, -0.002, 0})};
  for (const Camera& camera : cameras)
    for (const LampShape shape : {LampShape::disc, LampShape::rectangle}) {
      Lamp lamp = contribution_lamp();
      lamp.shape = shape;
      std::vector<double> errors;
      for (const double size_m : {0.2, 0.02}) {
        lamp.radius_m = size_m;
        lamp.size_m = {2 * size_m, size_m};
        errors.push_back(std::abs(flux_ratio(lamp, pose, camera) - 1));
      }
      EXPECT_LT(errors[1], 2e-4);
      EXPECT_LT(errors[0], 2e-2);
      EXPECT_GT(errors[0] / errors[1], 30) << "not of second order: " << errors[1];
    }
}

}  // namespace
