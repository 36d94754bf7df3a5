// SPDX-License-Identifier: Apache-2.0
// Images of a moving camera, compared with means and rows of still images.
#include <algorithm>
#include <cmath>

#include "libocc/simulate/plan.hpp"
#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

// Pose after a time under a constant twist, by the exponential series of the 4x4 matrix.
Rigid3 pose_after(const Rigid3& pose, const Vector6& velocity, double time_s) {
  Eigen::Matrix4d twist = Eigen::Matrix4d::Zero();
  twist.topLeftCorner<3, 3>() = skew(velocity.head<3>());
  twist.topRightCorner<3, 1>() = velocity.tail<3>();
  Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
  for (int k = 1; k < 30; ++k) sum += term *= twist * (time_s / k);
  return Rigid3::from_matrix(sum * pose.matrix());
}

double level(const Lamp& lamp, double time_s) {
  if (!lamp.frequency_hz) return 1;
  const double periods = time_s * *lamp.frequency_hz + lamp.phase;
  const double part = periods - std::floor(periods);
  if (lamp.waveform.empty()) return part < lamp.duty;
  return lamp.waveform[static_cast<std::size_t>(part * static_cast<double>(lamp.waveform.size()))];
}

// A lamp of 11 px that moves by 8 px in one exposure, and beside it a lamp that does not blink.
Scene moving_scene(LampShape shape = LampShape::disc) {
  Scene scene;
  scene.camera = Camera::pinhole(80, 60, 200, 200, 39.5, 29.5);
  scene.lamps = {disc_lamp(0, {0.1, 0.03, 1.5})};
  Lamp& lamp = scene.lamps[0];
  lamp.shape = shape;
  lamp.size_m = {0.2, 0.12};
  lamp.exponent = 4;
  lamp.normal = {0.3, 0.2, -1};
  lamp.half_power_rad = 1.2;
  scene.sensor.exposure_s = 0.02;
  scene.validate();
  return scene;
}

const Rigid3 start{so3_exp({0.02, -0.03, 0.4}), {0.05, 0.02, 0}};
const Vector6 quick = (Vector6() << 0.8, -1.9, 0.9, 0.3, -0.2, 0.5).finished();

SimulateOptions moving(const Vector6& velocity, double start_s = 0) {
  SimulateOptions options = noiseless(start_s);
  options.velocity = velocity;
  return options;
}

double peak_of(const Scene& scene) { return 1.5 * peak_electrons(scene, start); }

// Mean of still images over the exposure, weighted by the light of each instant. With a rolling
// shutter, each line is the mean of images of its own time; only one line in line_step is computed.
Eigen::MatrixXd mean_of_stills(const Scene& scene, const Vector6& velocity, double start_s,
                               double peak_e, int instants, int line_step = 1) {
  Scene lit = scene;
  for (Lamp& lamp : lit.lamps) {
    lamp.frequency_hz.reset();
    lamp.waveform.clear();
  }
  const Sensor& sensor = scene.sensor;
  const bool columns = sensor.readout == Readout::columns;
  const int lines = columns ? scene.camera.width() : scene.camera.height();
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(scene.camera.width(), scene.camera.height());
  for (int i = 0; i < (sensor.row_time_s > 0 ? lines : 1); i += line_step)
    for (int k = 0; k < instants; ++k) {
      const double time_s = i * sensor.row_time_s + sensor.exposure_s * (k + 0.5) / instants;
      const double light = level(scene.lamps[0], start_s + time_s) / instants;
      if (light == 0) continue;
      const Eigen::MatrixXd still =
          mean_electrons(lit, pose_after(start, velocity, time_s), peak_e);
      if (sensor.row_time_s == 0)
        mean += light * still;
      else if (columns)
        mean.row(i) += light * still.row(i);
      else
        mean.col(i) += light * still.col(i);
    }
  return mean;
}

// Largest difference between the rendered image and the mean of still images, relative to the peak.
double worst_error(const Scene& scene, const Vector6& velocity, double start_s, int instants,
                   int line_step = 1) {
  const double peak_e = peak_of(scene);
  const Eigen::MatrixXd truth =
      mean_of_stills(scene, velocity, start_s, peak_e, instants, line_step);
  const Eigen::MatrixXd image = mean_electrons(scene, start, peak_e, moving(velocity, start_s));
  EXPECT_GT(truth.maxCoeff(), 0.02 * peak_e) << "the lamp is not in view";
  double worst = 0;
  for (int y = 0; y < scene.camera.height(); y += line_step)
    worst = std::max(worst, (image.col(y) - truth.col(y)).cwiseAbs().maxCoeff() / peak_e);
  return worst;
}

TEST(MotionBlur, IsTheMeanOverTheExposure) {
  for (const LampShape shape :
       {LampShape::disc, LampShape::rectangle, LampShape::lame, LampShape::point}) {
    EXPECT_LT(worst_error(moving_scene(shape), quick, 0, 128), 2.5e-4) << static_cast<int>(shape);
    EXPECT_LT(worst_error(moving_scene(shape), 0.05 * quick, 0, 32), 1e-4)
        << static_cast<int>(shape);
  }
}

TEST(MotionBlur, HoldsWithDistortionAndWithoutGradientOrBlur) {
  Scene scene = moving_scene();
  scene.camera = Camera::pinhole(80, 60, 200, 200, 39.5, 29.5, {-0.3, 0.1, 0.003, -0.002});
  EXPECT_LT(worst_error(scene, quick, 0, 128), 2.5e-4);
  scene.effects.set(Effect::light_gradient, Use::off);
  EXPECT_LT(worst_error(scene, quick, 0, 128), 2.5e-4);
  scene.effects.set(Effect::psf, Use::off);
  EXPECT_LT(worst_error(scene, quick, 0, 100), 3e-3);
  scene.effects.set(Effect::extent, Use::off);
  scene.effects.set(Effect::psf, Use::on);
  EXPECT_LT(worst_error(scene, quick, 0, 128), 2.5e-4);
}

TEST(MotionBlur, TheComparisonDetectsAnExposureErrorOfOnePercent) {
  Scene scene = moving_scene();
  const double peak_e = peak_of(scene);
  const Eigen::MatrixXd truth = mean_of_stills(scene, quick, 0, peak_e, 64);
  const Eigen::MatrixXd image = mean_electrons(scene, start, peak_e, moving(1.01 * quick));
  EXPECT_GT((image - truth).cwiseAbs().maxCoeff() / peak_e, 1e-3);
}

TEST(MotionBlur, OfABlinkingLampIsWeightedByItsLight) {
  for (const LampShape shape : {LampShape::disc, LampShape::point})
    for (const double frequency_hz : {35.0, 130.0, 900.0}) {
      Scene scene = moving_scene(shape);
      Lamp& lamp = scene.lamps[0];
      lamp.frequency_hz = frequency_hz;
      lamp.duty = 0.3;
      lamp.phase = 0.1;
      EXPECT_LT(worst_error(scene, quick, 0.013, 1000), 1.5e-3) << frequency_hz;
      scene.lamps[0].waveform = {1, 0, 0.5, 0.2, 0};
      EXPECT_LT(worst_error(scene, quick, 0.013, 1000), 1.5e-3) << frequency_hz;
    }
}

TEST(MotionBlur, ALampThatIsDarkDuringTheExposureIsNotInTheImage) {
  Scene scene = moving_scene();
  scene.lamps[0].frequency_hz = 1;
  scene.lamps[0].duty = 0.5;
  const Rendered rendered = simulate(scene, start, moving(quick, 0.7));
  EXPECT_EQ(rendered.lamps[0].electrons, 0);
  EXPECT_TRUE(rendered.lamps[0].in_view);
}

TEST(RollingMotion, EveryLineSeesItsOwnPose) {
  for (const Readout readout : {Readout::rows, Readout::columns})
    for (const LampShape shape :
         {LampShape::disc, LampShape::rectangle, LampShape::lame, LampShape::point}) {
      Scene scene = moving_scene(shape);
      scene.sensor.readout = readout;
      scene.sensor.exposure_s = 1e-6;  // practically instantaneous
      scene.sensor.row_time_s = 2e-4;
      EXPECT_LT(worst_error(scene, quick, 0, 1), 1e-4) << static_cast<int>(shape);
    }
}

TEST(RollingMotion, HoldsWithBlurAndBlinking) {
  Scene scene = moving_scene();
  scene.sensor.exposure_s = 0.004;
  scene.sensor.row_time_s = 2e-4;
  EXPECT_LT(worst_error(scene, quick, 0, 32, 4), 1e-4);
  scene.lamps[0].frequency_hz = 300;
  EXPECT_LT(worst_error(scene, quick, 0.01, 400, 12), 1e-3);
  scene.effects.set(Effect::psf, Use::off);
  scene.lamps[0].frequency_hz.reset();
  EXPECT_LT(worst_error(scene, quick, 0, 40, 12), 3e-3);
}

TEST(RollingMotion, BlurOfALampThatBlinksByLinesWithoutRollingPoses) {
  // The poses of the lines are left out, but not their light.
  Scene scene = moving_scene();
  scene.sensor.exposure_s = 0.004;
  scene.sensor.row_time_s = 2e-4;
  scene.lamps[0].frequency_hz = 100;
  scene.effects.set(Effect::rolling_shutter, Use::off);
  const double peak_e = peak_of(scene);
  const Eigen::MatrixXd image = mean_electrons(scene, start, peak_e, moving(quick));
  Scene lit = scene;
  lit.lamps[0].frequency_hz.reset();
  const Eigen::MatrixXd steady = mean_electrons(lit, start, peak_e, moving(quick));
  for (int y = 0; y < 60; ++y) {
    // Exposures during which the lamp is lit or dark throughout.
    const double phase = std::fmod(y * 2e-4 * 100, 1);
    if (phase > 0.5 && phase < 0.59) {
      EXPECT_EQ(image.col(y).maxCoeff(), 0) << y;
    } else if (phase > 0.01 && phase < 0.09) {
      EXPECT_LT((image.col(y) - steady.col(y)).cwiseAbs().maxCoeff(), 1e-4 * peak_e) << y;
    }
  }
}

TEST(RollingMotion, TruthIsTheProjectionAtTheTimeOfEachLine) {
  for (const Readout readout : {Readout::rows, Readout::columns}) {
    Scene scene = moving_scene();
    scene.sensor.readout = readout;
    scene.sensor.exposure_s = 0.002;
    scene.sensor.row_time_s = 2e-4;
    const LampTruth truth = simulate(scene, start, moving(quick)).lamps[0];
    const auto seen_at = [&](const Eigen::Vector3d& point, const Eigen::Vector2d& px) {
      const double line = readout == Readout::rows ? px.y() : px.x();
      return *scene.camera.project(pose_after(start, quick, line * 2e-4 + 0.001) * point);
    };
    EXPECT_LT((truth.centre_px - seen_at(scene.lamps[0].centre_m, truth.centre_px)).norm(), 1e-6);
    EXPECT_GT((truth.centre_px - *scene.camera.project(start * scene.lamps[0].centre_m)).norm(), 1);
    ASSERT_TRUE(truth.whole);
    // The centroid of the image agrees with the centre in the truth as well as without motion.
    scene.effects.set(Effect::light_gradient, Use::off);
    const double peak_e = peak_of(scene);
    const Eigen::MatrixXd image = mean_electrons(scene, start, peak_e, moving(quick));
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 80; ++x) mean += image(x, y) / image.sum() * Eigen::Vector2d(x, y);
    EXPECT_LT((mean - truth.image_centre_px).norm(), 0.02);
    for (const Eigen::Vector2d& px : truth.rim_px) {
      const double value = image(std::lround(px.x()), std::lround(px.y())) / image.maxCoeff();
      EXPECT_NEAR(value, 0.5, 0.35);
    }
  }
}

TEST(Motion, LeftOutIsTheImageFromTheMiddleOfTheFirstLinesExposure) {
  Scene scene = moving_scene();
  scene.sensor.row_time_s = 2e-4;
  scene.effects.set(Effect::motion_blur, Use::off);
  scene.effects.set(Effect::rolling_shutter, Use::off);
  const Image image = simulate(scene, start, moving(quick)).image;
  const Rigid3 middle = pose_after(start, quick, 0.5 * scene.sensor.exposure_s);
  const double peak_e = peak_of(scene);
  const Eigen::MatrixXd difference =
      mean_electrons(scene, start, peak_e, moving(quick)) - mean_electrons(scene, middle, peak_e);
  EXPECT_LT(difference.cwiseAbs().maxCoeff() / peak_e, 2e-5);
}

TEST(Motion, ZeroVelocityChangesNoBit) {
  Scene scene = moving_scene();
  scene.sensor.row_time_s = 2e-4;
  scene.lamps[0].frequency_hz = 300;
  const Image with = simulate(scene, start).image;
  Scene without = scene;
  without.effects.set(Effect::motion_blur, Use::off);
  without.effects.set(Effect::rolling_shutter, Use::off);
  EXPECT_EQ(with.u8, simulate(without, start).image.u8);
  const RenderPlan plan = plan_render(scene, start);
  EXPECT_FALSE(plan.applies(Effect::motion_blur));
  EXPECT_FALSE(plan.applies(Effect::rolling_shutter));
}

TEST(Motion, ALampThatLeavesTheLensDomainIsNotRendered) {
  Scene scene = moving_scene();
  scene.camera = Camera::pinhole(80, 60, 40, 40, 39.5, 29.5, {-0.5, 0, 0, 0});
  Vector6 turn = Vector6::Zero();
  turn[1] = 60;
  const Rendered rendered = simulate(scene, start, moving(turn));
  EXPECT_EQ(rendered.lamps[0].electrons, 0);
}

}  // namespace
