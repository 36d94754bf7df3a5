// SPDX-License-Identifier: Apache-2.0
// Effects of the lens on a lamp's image: diffraction, defocus, no blur, vignetting, cos^4.
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "tests/support/exact_area.hpp"
#include "tests/support/quadrature.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

Scene lens_scene(LampShape shape = LampShape::disc) {
  Scene scene;
  scene.camera = Camera::pinhole(80, 60, 200, 200, 39.5, 29.5);
  scene.lamps = {disc_lamp(0, {0.06, 0.03, 1.5}, 0.06)};
  Lamp& lamp = scene.lamps[0];
  lamp.shape = shape;
  lamp.size_m = {0.14, 0.09};
  lamp.exponent = 4;
  lamp.normal = {0.3, 0.2, -1};
  lamp.half_power_rad = 1.2;
  scene.validate();
  return scene;
}

const Rigid3 pose{so3_exp({0.02, -0.03, 0.4}), {0.05, 0.02, 0}};

double peak_of(const Scene& scene) { return peak_electrons(scene, pose); }

double worst(const Eigen::MatrixXd& difference, double peak_e) {
  return difference.cwiseAbs().maxCoeff() / peak_e;
}

TEST(Diffraction, IsAGaussianOfTheAiryDiscsCore) {
  Scene with = lens_scene();
  with.lens.diffraction = true;
  with.sensor.f_number = 11;
  Scene without = with;
  without.lens.diffraction = false;
  without.sensor.psf_sigma_px = std::hypot(0.8, 0.42 * 550e-9 * 11 / 7.1e-6);
  const double peak_e = peak_of(with);
  EXPECT_EQ(
      worst(mean_electrons(with, pose, peak_e) - mean_electrons(without, pose, peak_e), peak_e), 0);
}

// Radius by the lens equation. A lens focused at z_f images a point at z at the distance v_z. The
// cone of light from a lens of diameter D to that image meets the sensor at v.
double confusion_radius_px(const Scene& scene, double depth_m) {
  const double pitch = scene.sensor.pixel_pitch_m, v = scene.camera.fx_px() * pitch;
  const double diameter = v / scene.sensor.f_number;
  const double power = 1 / v + 1 / *scene.lens.focus_distance_m;
  const double v_z = 1 / (power - 1 / depth_m);
  return 0.5 * diameter * std::abs(v - v_z) / v_z / pitch;
}

// Sets a focus that blurs the lamp by a disc of this radius, and a wide lens, which `scene` lacks.
void blur_by(double radius_px, Scene& scene) {
  scene.sensor.f_number = 0.01;  // not realistic, but a lens of 1.4 mm does not blur the lamp
  scene.lens.focus_distance_m = 1e3;
  const double all = confusion_radius_px(scene, (pose * scene.lamps[0].centre_m).z());
  scene.sensor.f_number *= all / radius_px;
}

// Mean of images with the lamp shifted over the disc of confusion.
Eigen::MatrixXd mean_of_shifted(Scene scene, double peak_e) {
  const double radius = confusion_radius_px(scene, (pose * scene.lamps[0].centre_m).z());
  scene.lens.focus_distance_m.reset();
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(80, 60);
  const int around = 48;
  for (const Eigen::Vector2d& ring : quadrature(6))
    for (int i = 0; i < around; ++i) {
      const double r = radius * (ring.x() + 0.5), angle = 2 * pi * i / around;
      scene.camera =
          Camera::pinhole(80, 60, 200, 200, 39.5 + r * std::cos(angle), 29.5 + r * std::sin(angle));
      mean += ring.y() * 2 * (ring.x() + 0.5) / around * mean_electrons(scene, pose, peak_e);
    }
  return mean;
}

TEST(Defocus, IsTheMeanOverTheDiscOfConfusion) {
  for (const LampShape shape : {LampShape::disc, LampShape::rectangle, LampShape::point})
    for (const double radius : {0.3, 0.7, 1.5, 4.0}) {
      Scene scene = lens_scene(shape);
      blur_by(radius, scene);
      const double peak_e = 1.5 * peak_of(scene);
      Scene focused = scene;
      focused.lens.focus_distance_m.reset();
      const double still_peak_e = 1.3 * std::max(peak_e, peak_of(focused));
      const Eigen::MatrixXd truth = mean_of_shifted(scene, still_peak_e);
      const Eigen::MatrixXd image = mean_electrons(scene, pose, peak_e);
      EXPECT_LT((image - truth).cwiseAbs().maxCoeff() / truth.maxCoeff(), 1e-3)
          << static_cast<int>(shape) << ' ' << radius;
      EXPECT_NEAR(image.sum() / truth.sum(), 1, 1e-3);
    }
}

TEST(Defocus, TheComparisonDetectsARadiusErrorOfTwoPercent) {
  Scene scene = lens_scene();
  blur_by(4, scene);
  const double peak_e = 1.3 * peak_of(scene);
  const Eigen::MatrixXd truth = mean_of_shifted(scene, 2 * peak_e);
  scene.sensor.f_number /= 1.02;
  const Eigen::MatrixXd image = mean_electrons(scene, pose, 1.1 * peak_e);
  EXPECT_GT((image / image.sum() - truth / truth.sum()).cwiseAbs().maxCoeff(),
            1e-3 * truth.maxCoeff() / truth.sum());
}

TEST(Defocus, AtTheLampsDepthChangesNoBit) {
  Scene scene = lens_scene();
  const Image sharp = simulate(scene, pose).image;
  scene.lens.focus_distance_m = (pose * scene.lamps[0].centre_m).z();
  EXPECT_EQ(simulate(scene, pose).image.u8, sharp.u8);
}

TEST(Defocus, MovesWithTheLampUnderAMovingCamera) {
  // Expected is the mean over shifted images of the moving camera.
  for (const double row_time_s : {0.0, 1e-4}) {
    Scene scene = lens_scene();
    blur_by(2.5, scene);
    scene.sensor.exposure_s = 0.01;
    scene.sensor.row_time_s = row_time_s;
    SimulateOptions options = noiseless();
    options.velocity << 0.5, -1, 0.4, 0.2, 0.1, 0;
    const double peak_e = 1.3 * peak_of(scene);
    const Eigen::MatrixXd image = mean_electrons(scene, pose, peak_e, options);
    const double radius = confusion_radius_px(scene, (pose * scene.lamps[0].centre_m).z());
    scene.lens.focus_distance_m.reset();
    Eigen::MatrixXd truth = Eigen::MatrixXd::Zero(80, 60);
    for (const Eigen::Vector2d& ring : quadrature(3))
      for (int i = 0; i < 24; ++i) {
        const double r = radius * (ring.x() + 0.5), angle = 2 * pi * i / 24;
        const Eigen::Vector2d shift(r * std::cos(angle), r * std::sin(angle));
        scene.camera = Camera::pinhole(80, 60, 200, 200, 39.5 + shift.x(), 29.5 + shift.y());
        // The time belongs to the line that receives the light, so the camera is shifted, not the
        // lines.
        truth += ring.y() * 2 * (ring.x() + 0.5) / 24 *
                 mean_electrons(scene, pose, 1.5 * peak_e, options);
      }
    EXPECT_LT(worst(image - truth, peak_e), 1e-3) << row_time_s;
  }
}

TEST(NoBlur, IsTheExactAreaInEachPixel) {
  Scene scene = lens_scene();
  scene.lamps[0] = disc_lamp(0, {0.06, 0.03, 1.5}, 0.06);
  scene.effects.set(Effect::psf, Use::off);
  scene.effects.set(Effect::light_gradient, Use::off);
  const double peak_e = 1.1 * mean_electrons(scene, Rigid3{}, 1e6).maxCoeff();
  const Eigen::MatrixXd image = mean_electrons(scene, Rigid3{}, peak_e);
  const double full = image(48, 34);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x)
      EXPECT_NEAR(image(x, y) / full, disc_in_pixel(Eigen::Vector2d(x, y), {47.5, 33.5}, 8), 4e-5);
}

TEST(NoBlur, WithTheGradientIsTheSumOverSmallElements) {
  Scene scene = lens_scene();
  scene.effects.set(Effect::psf, Use::off);
  const double peak_e = peak_of(scene);
  const Eigen::MatrixXd image = mean_electrons(scene, pose, peak_e);
  const Lamp& lamp = scene.lamps[0];
  // Sum of the irradiance over points of each pixel inside the image.
  const double per_irradiance = scene.sensor.electrons(1) - scene.sensor.electrons(0);
  const Eigen::Vector3d centre = pose * lamp.centre_m, normal = pose.rotation * lamp.normal;
  double off = 0;
  const double full = image.maxCoeff();
  for (int y = 15; y < 55; ++y)
    for (int x = 30; x < 75; ++x) {
      const bool at_rim =
          image(x, y) > 0 && image.block<3, 3>(x - 1, y - 1).minCoeff() < 0.9 * full;
      const int n = at_rim ? 150 : 4;
      double sum = 0;
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const Eigen::Vector2d px(x + (i + 0.5) / n - 0.5, y + (j + 0.5) / n - 0.5);
          const Eigen::Vector3d ray = *scene.camera.unproject(px);
          const Eigen::Vector3d at = ray * (centre.dot(normal) / ray.dot(normal));
          if ((at - centre).norm() > lamp.radius_m) continue;
          sum += irradiance_at(lamp, pose, scene.camera, scene.sensor, px) / (n * n);
        }
      off = std::max(off, std::abs(sum * per_irradiance - image(x, y)));
    }
  EXPECT_LT(off / peak_e, 5e-4);  // resolution of the rim by the points
}

TEST(NoBlur, APointIsInOnePixel) {
  Scene scene = lens_scene(LampShape::point);
  scene.effects.set(Effect::psf, Use::off);
  const LampTruth truth = simulate(scene, pose, noiseless()).lamps[0];
  const Eigen::MatrixXd image = mean_electrons(scene, pose, 1.1 * truth.electrons);
  const double there = image(std::lround(truth.centre_px.x()), std::lround(truth.centre_px.y()));
  EXPECT_NEAR(there / truth.electrons, 1, 2e-5);
  EXPECT_NEAR(image.sum() / there, 1, 1e-12);
}

double transmission(const Scene& scene, const Eigen::Vector2d& px) {
  const Eigen::Vector2d centre(scene.camera.cx_px(), scene.camera.cy_px());
  const Eigen::Vector2d corner(scene.camera.width() - 0.5,
                               -0.5);  // farthest corner from the centre
  const double q2 = (px - centre).squaredNorm() / (corner - centre).squaredNorm();
  return 1 + scene.lens.vignetting[0] * q2 + scene.lens.vignetting[1] * q2 * q2;
}

TEST(Vignetting, IsAFactorAtEachPixel) {
  Scene scene = lens_scene();
  scene.camera = Camera::pinhole(80, 60, 200, 200, 30, 40);
  scene.lamps[0].radius_m = 2;  // fills the image
  const double peak_e = peak_of(scene);
  const Eigen::MatrixXd without = mean_electrons(scene, pose, peak_e);
  scene.lens.vignetting = {-0.6, 0.2};
  for (const bool gradient : {true, false}) {
    scene.effects.set(Effect::light_gradient, gradient ? Use::on : Use::off);
    const Eigen::MatrixXd with = mean_electrons(scene, pose, peak_e);
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 80; ++x) {
        const double even = gradient ? without(x, y) : with(30, 40);
        EXPECT_NEAR(with(x, y) / even, transmission(scene, {x, y}), 5e-4) << x << ' ' << y;
      }
  }
}

TEST(Vignetting, IsTakenAtThePositionOfAPointAlsoUnderMotion) {
  for (const LampShape shape : {LampShape::point, LampShape::disc}) {
    Scene scene = lens_scene(shape);
    scene.lamps[0].radius_m = 0.01;
    scene.camera = Camera::pinhole(80, 60, 200, 200, 10, 50);
    const double without = simulate(scene, pose).lamps[0].electrons;
    scene.lens.vignetting = {-0.6, 0.2};
    const LampTruth truth = simulate(scene, pose).lamps[0];
    EXPECT_NEAR(truth.electrons / without, transmission(scene, truth.centre_px), 1e-3);
    SimulateOptions moving;
    moving.velocity << 1, -1, 0, 0, 0, 0;
    scene.sensor.row_time_s = 1e-4;
    const LampTruth moved = simulate(scene, pose, moving).lamps[0];
    EXPECT_GT((moved.centre_px - truth.centre_px).norm(), 0.5);
    scene.lens.vignetting.clear();
    const double bright = simulate(scene, pose, moving).lamps[0].electrons;
    scene.lens.vignetting = {-0.6, 0.2};
    EXPECT_NEAR(moved.electrons / bright, transmission(scene, moved.centre_px), 1e-3);
  }
}

TEST(Vignetting, WithZeroCoefficientsChangesNoBit) {
  Scene scene = lens_scene();
  const Image without = simulate(scene, pose).image;
  scene.lens.vignetting = {0, 0};
  EXPECT_EQ(simulate(scene, pose).image.u8, without.u8);
}

TEST(LightGradient, ShiftsTheCentroidByItsKnownValue) {
  // A ceiling lamp of order m = 0.646 is 30 degrees off the axis of an upright camera. E is
  // proportional to cos^4 psi cos^(m-1) phi with psi = phi, so
  // grad ln E = -(m + 3) tan(psi) cos^2(psi) / f. The centroid of an R x R' ellipse moves by R^2/4
  // times this gradient.
  Scene scene;
  const double f = 422.5, height = 1.5, angle = pi / 6;
  scene.camera = Camera::pinhole(640, 480, f, f, 100, 239.5);
  scene.lamps = {disc_lamp(0, {height * std::tan(angle), 0, height}, 0.085)};
  scene.lamps[0].half_power_rad = 70 * pi / 180;
  const auto centroid = [&](Use gradient) {
    scene.effects.set(Effect::light_gradient, gradient);
    const double peak_e = 1.1 * mean_electrons(scene, Rigid3{}, 2e4).maxCoeff();
    const Eigen::MatrixXd image = mean_electrons(scene, Rigid3{}, peak_e);
    double moment = 0;
    for (int x = 0; x < 640; ++x) moment += x * image.row(x).sum();
    return moment / image.sum();
  };
  const double radius = f * 0.085 / height;
  const double m = scene.lamps[0].order();
  const double expected =
      radius * radius / 4 * (m + 3) * std::tan(angle) * std::pow(std::cos(angle), 2) / f;
  EXPECT_GT(expected, 0.27);
  EXPECT_NEAR((centroid(Use::off) - centroid(Use::on)) / expected, 1, 0.01);
}

TEST(LightGradient, FluxFollowsTheApertureFormulaToSecondOrderInSize) {
  Scene scene = lens_scene();
  for (const double ratio : {0.04, 0.02, 0.01}) {
    Lamp& lamp = scene.lamps[0];
    lamp.radius_m = ratio * (pose * lamp.centre_m).norm();
    const double expected = lamp_electrons(lamp, pose, scene.camera, scene.sensor);
    EXPECT_NEAR(simulate(scene, pose).lamps[0].electrons / expected, 1, 3 * ratio * ratio) << ratio;
  }
}

}  // namespace
