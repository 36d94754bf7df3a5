// SPDX-License-Identifier: Apache-2.0
// Prediction of the lamps' images, their windows and the assignment of blobs to them.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libocc/formation/rim.hpp"
#include "libocc/geometry/motion.hpp"
#include "libocc/track/internal/expected_lamps.hpp"
#include "tests/support/support.hpp"

namespace occ::internal::track {
namespace {

/// A room, a tilted camera near the floor and its motion.
struct MovingCamera {
  Scene scene = test::irregular_room();
  PredictedCamera predicted;

  MovingCamera() {
    scene.sensor.exposure_s = 4e-3;
    scene.sensor.row_time_s = 5e-5;
    predicted.cam_from_world = look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
    predicted.covariance.diagonal() << 1e-6, 2e-6, 4e-6, 1e-4, 3e-4, 2e-4;
    predicted.covariance(0, 4) = predicted.covariance(4, 0) = 1e-5;
  }
  std::vector<ExpectedLamp> expected(double model_sigma_px = 0.5) const {
    return expected_lamps(scene, predicted, 4, model_sigma_px);
  }
  Eigen::Vector2d projected(int lamp, const Rigid3& pose) const {
    return *scene.camera.project(pose * scene.lamps[static_cast<std::size_t>(lamp)].centre_m);
  }
  Eigen::MatrixXd derivative(int lamp, const Rigid3& pose) const {
    return test::numerical_jacobian(
        [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
          return projected(lamp, perturb(pose, step));
        },
        Vector6::Zero());
  }
};

TEST(ReadoutDelay, IsTheMiddleOfTheExposureOfALine) {
  Sensor sensor;
  sensor.exposure_s = 0.01;
  sensor.row_time_s = 1e-4;
  EXPECT_DOUBLE_EQ(readout_delay_s(sensor, {7, 30}), 0.005 + 0.003);
  EXPECT_DOUBLE_EQ(readout_delay_s(sensor, {7, -30}), 0.005);
  sensor.readout = Readout::columns;
  EXPECT_DOUBLE_EQ(readout_delay_s(sensor, {7, 30}), 0.005 + 0.0007);
  std::vector<Blob> blobs(3);
  blobs[0].centroid_px = {10, 500};
  blobs[2].centroid_px = {30, 100};
  EXPECT_DOUBLE_EQ(mean_delay_s(sensor, {{4, 0}, {1, 2}}, blobs), 0.005 + 0.002);
  EXPECT_EQ(mean_delay_s(sensor, {}, blobs), 0);
}

TEST(ExpectedLamps, HavePlaceAndCovarianceOfThePrediction) {
  const MovingCamera camera;
  const std::vector<ExpectedLamp> lamps = camera.expected();
  ASSERT_EQ(lamps.size(), camera.scene.lamps.size());
  for (int i = 0; i < 6; ++i) {
    const Rigid3& pose = camera.predicted.cam_from_world;
    const ExpectedLamp& lamp = lamps[static_cast<std::size_t>(i)];
    EXPECT_EQ(lamp.lamp, i);
    EXPECT_LT((lamp.px - camera.projected(i, pose)).norm(), 1e-9);
    const Eigen::MatrixXd by_pose = camera.derivative(i, pose);
    Eigen::Matrix2d covariance = by_pose * camera.predicted.covariance * by_pose.transpose();
    covariance.diagonal().array() += 0.25;
    EXPECT_LT((lamp.covariance_px2 - covariance).norm(), 1e-5 * covariance.norm());
    EXPECT_EQ(lamp.smear_px, 0);
    EXPECT_FALSE(lamp.dark);
    EXPECT_FALSE(lamp.cut);
  }
}

TEST(ExpectedLamps, AreWhereTheMovingCameraSeesThemInTheirLine) {
  MovingCamera camera;
  camera.predicted.velocity << 0.2, -0.3, 0.5, 0.4, 0.1, -0.3;
  const std::vector<ExpectedLamp> lamps = camera.expected();
  ASSERT_EQ(lamps.size(), 6u);
  for (int i = 0; i < 6; ++i) {
    const Rigid3& pose = camera.predicted.cam_from_world;
    const double delay_s = readout_delay_s(camera.scene.sensor, camera.projected(i, pose));
    const Rigid3 then = moved_pose(pose, camera.predicted.velocity, delay_s);
    const ExpectedLamp& lamp = lamps[static_cast<std::size_t>(i)];
    EXPECT_LT((lamp.px - camera.projected(i, then)).norm(), 1e-9);
    EXPECT_GT((lamp.px - camera.projected(i, pose)).norm(), 0.2);
    const double speed_px_s = (camera.derivative(i, then) * camera.predicted.velocity).norm();
    EXPECT_NEAR(lamp.smear_px, 4e-3 * speed_px_s, 1e-4 * lamp.smear_px);
  }
}

TEST(ExpectedLamps, HaveTheExtentOfTheirImageAcrossTheLines) {
  MovingCamera camera;
  for (Lamp& lamp : camera.scene.lamps) lamp.normal = Eigen::Vector3d(0.6, -0.3, -1).normalized();
  for (const Readout readout : {Readout::rows, Readout::columns}) {
    camera.scene.sensor.readout = readout;
    for (const ExpectedLamp& expected : camera.expected()) {
      const auto rim = project_rim(camera.scene.lamps[static_cast<std::size_t>(expected.lamp)],
                                   camera.predicted.cam_from_world, camera.scene.camera, 200);
      const int axis = readout == Readout::columns ? 0 : 1;
      double low = 1e9, high = -1e9, farthest = 0;
      for (const Eigen::Vector2d& px : *rim) {
        low = std::min(low, px[axis]);
        high = std::max(high, px[axis]);
        farthest = std::max(farthest, (px - expected.px).norm());
      }
      EXPECT_NEAR(expected.lines_px, high - low, 0.02 * (high - low));
      EXPECT_GT(expected.radius_px, farthest);
      EXPECT_LT(expected.radius_px, 2 * farthest);
    }
  }
}

TEST(ExpectedLamps, AreThoseInViewOnly) {
  MovingCamera camera;
  camera.scene.lamps[0].normal = Eigen::Vector3d::UnitZ();  // dark side
  camera.scene.lamps[1].centre_m.z() = -1;                  // behind the camera, and lit towards it
  camera.scene.lamps[1].normal = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d eye = camera.predicted.cam_from_world.origin_in_source();
  const Eigen::Vector3d on_way = 0.5 * (eye + camera.scene.lamps[2].centre_m);
  camera.scene.boxes = {{on_way.array() - 0.05, on_way.array() + 0.05}};
  camera.scene.lamps[3].centre_m = {20, 2, 3};  // far outside the image
  std::vector<int> seen;
  for (const ExpectedLamp& lamp : camera.expected()) seen.push_back(lamp.lamp);
  EXPECT_EQ(seen, (std::vector<int>{4, 5}));
}

/// Lamp 4 at the given pixel, with the camera's normal pointing to it.
ExpectedLamp lamp_at(MovingCamera camera, const Eigen::Vector2d& px) {
  const Eigen::Vector3d ray = *camera.scene.camera.unproject(px);
  camera.scene.lamps[4].centre_m = camera.predicted.cam_from_world.inverse() * (2 * ray);
  for (const ExpectedLamp& lamp : camera.expected())
    if (lamp.lamp == 4) return lamp;
  ExpectedLamp none;
  none.lamp = -1;
  return none;
}

TEST(ExpectedLamps, AreSureOnlyIfTheGateIsInsideTheImage) {
  const MovingCamera camera;
  const ExpectedLamp middle = lamp_at(camera, {320, 240});
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(middle.covariance_px2);
  const double reach = middle.radius_px + 4 * std::sqrt(eigen.eigenvalues()[1]);
  EXPECT_TRUE(middle.sure);
  for (const double side : {-1, 1}) {
    const double border = side < 0 ? 0 : 639;
    // The reach grows a little towards the border of the image.
    EXPECT_TRUE(lamp_at(camera, {border - side * 1.5 * reach, 240}).sure);
    EXPECT_FALSE(lamp_at(camera, {border - side * 0.8 * reach, 240}).sure);
    EXPECT_EQ(lamp_at(camera, {border + side * 0.8 * reach, 240}).lamp, 4);
    EXPECT_FALSE(lamp_at(camera, {border + side * 0.8 * reach, 240}).sure);
    EXPECT_EQ(lamp_at(camera, {border + side * 2.5 * reach, 240}).lamp, -1);
  }
}

TEST(ExpectedLamps, AreNotSureIfObliqueOrDark) {
  MovingCamera camera;
  const Eigen::Vector3d eye = camera.predicted.cam_from_world.origin_in_source();
  const Eigen::Vector3d to_camera = (eye - camera.scene.lamps[4].centre_m).normalized();
  const Eigen::Vector3d across = to_camera.unitOrthogonal();
  const auto tilted = [&](double cosine) {
    camera.scene.lamps[4].normal = cosine * to_camera + std::sqrt(1 - cosine * cosine) * across;
    return camera.expected().at(4).sure;
  };
  EXPECT_TRUE(tilted(0.2));
  EXPECT_FALSE(tilted(0.03));
  EXPECT_TRUE(tilted(1));

  // Exposure of 4 ms; the lamp's lines take 5e-5 s each to read out.
  camera.scene.lamps[4].frequency_hz = 100;
  const auto with_duty = [&](double duty) {
    camera.scene.lamps[4].duty = duty;
    return camera.expected().at(4);
  };
  const double read_s = 4e-3 + 5e-5 * with_duty(1).lines_px;
  EXPECT_GT(read_s, 4.5e-3);
  EXPECT_LT(read_s, 9e-3);
  EXPECT_FALSE(with_duty(0.65).cut);  // dark for 3.5 ms
  EXPECT_TRUE(with_duty(0.65).sure);
  const double some = 1 - (0.004 + 0.3 * (read_s - 0.004)) / 0.01;
  EXPECT_TRUE(with_duty(some).cut);
  EXPECT_FALSE(with_duty(some).dark);
  EXPECT_TRUE(with_duty(some).sure);
  const double all = 1 - 1.05 * read_s / 0.01;
  EXPECT_TRUE(with_duty(all).dark);
  EXPECT_FALSE(with_duty(all).sure);
  camera.scene.sensor.row_time_s = 0;
  EXPECT_FALSE(with_duty(some).cut);
}

TEST(ExpectedLamps, AreDarkForTheLongestPauseOfTheirWaveform) {
  MovingCamera camera;
  camera.scene.sensor.row_time_s = 0;
  camera.scene.lamps[4].frequency_hz = 50;  // eight parts of 2.5 ms
  const auto is_dark = [&](const std::vector<double>& waveform, double exposure_s) {
    camera.scene.sensor.exposure_s = exposure_s;
    camera.scene.lamps[4].waveform = waveform;
    return camera.expected().at(4).dark;
  };
  const std::vector<double> three{1, 0, 0, 0, 1, 1, 0, 1};
  EXPECT_TRUE(is_dark(three, 0.0074));
  EXPECT_FALSE(is_dark(three, 0.0076));
  const std::vector<double> around{0, 0, 1, 0, 0, 0.2, 0, 0};  // four from the end to the start
  EXPECT_TRUE(is_dark(around, 0.0099));
  EXPECT_FALSE(is_dark(around, 0.0101));
  const std::vector<double> never(8, 0.0);
  EXPECT_TRUE(is_dark(never, 0.0199));
  EXPECT_FALSE(is_dark(never, 0.0201));
}

TEST(LampWindows, ContainTheGateAndBackgroundAndEndAtTheBorder) {
  ExpectedLamp lamp;
  lamp.px = {300.4, 200.3};
  lamp.covariance_px2 << 100, 30, 30, 25;
  const double gate =
      4 * std::sqrt(
              Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(lamp.covariance_px2).eigenvalues()[1]);
  const Camera camera = test::vga_camera();
  for (const double radius : {0.0, 3.0, 60.0}) {
    lamp.radius_px = radius;
    const PixelWindow window = windows_of({lamp}, camera, 4).at(0);
    // Five pixels of background or more beside the gate, and two lamp radii of it in the window.
    const double half = std::max(radius + gate + 5, 2 * radius);
    EXPECT_LE(window.x0, lamp.px.x() - half);
    EXPECT_LE(window.y0, lamp.px.y() - half);
    EXPECT_GE(window.x1, lamp.px.x() + half);
    EXPECT_GE(window.y1, lamp.px.y() + half);
    EXPECT_LT(window.x1 - window.x0, 2 * (3 * radius + gate + 30));
    EXPECT_NEAR(window.x0 + window.x1, 2 * lamp.px.x(), 2);
    EXPECT_NEAR(window.y0 + window.y1, 2 * lamp.px.y(), 2);
  }
  lamp.px = {3, 476};
  const PixelWindow corner = windows_of({lamp}, camera, 4).at(0);
  EXPECT_EQ(corner.x0, 0);
  EXPECT_EQ(corner.y1, 479);
  lamp.px = {636, 4};
  const PixelWindow other = windows_of({lamp}, camera, 4).at(0);
  EXPECT_EQ(other.x1, 639);
  EXPECT_EQ(other.y0, 0);
}

}  // namespace
}  // namespace occ::internal::track
