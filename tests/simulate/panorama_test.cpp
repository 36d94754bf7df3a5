// SPDX-License-Identifier: Apache-2.0
// Lamps at the seam of an image that covers 360 degrees.
#include <gtest/gtest.h>

#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/simulate_support.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

constexpr int columns = 360;

/// A lamp on the wall ahead of the camera, and a larger one half a turn farther, below the horizon.
Scene walls() {
  Scene scene;
  scene.camera =
      Camera::equirectangular(columns, 160, 2 * pi / columns, columns / (2 * pi), 179.5, 79.5);
  scene.lamps = {disc_lamp(0, {0, -0.4, 2}, 0.2), disc_lamp(1, {0.3, 0.5, -2.5}, 0.3)};
  scene.lamps[0].normal = {0, 0, -1};
  scene.lamps[1].normal = {0, 0, 1};
  for (Lamp& lamp : scene.lamps) lamp.x_axis = {1, 0, 0};
  scene.sensor.psf_sigma_px = 0.8;
  return scene;
}

/// Camera turned about the vertical so that its image moves by this number of columns.
Rigid3 turned(double by_columns) {
  return {so3_exp({0, 2 * pi * by_columns / columns, 0}), Eigen::Vector3d::Zero()};
}

TEST(Panorama, ATurnOfTheCameraMovesTheImageAcrossTheSeam) {
  const Scene scene = walls();
  const double peak_e = 1.1 * peak_electrons(scene, turned(0));
  const Eigen::MatrixXd before = mean_electrons(scene, turned(0), peak_e);
  EXPECT_GT(before.sum(), 1000);
  // 180 columns bring the first lamp to the seam, 175 and 186 cut it unequally.
  for (const int by : {90, 175, 180, 186, 270}) {
    const Eigen::MatrixXd after = mean_electrons(scene, turned(by), peak_e);
    double worst = 0;
    for (int x = 0; x < columns; ++x)
      worst =
          std::max(worst, (after.row((x + by) % columns) - before.row(x)).cwiseAbs().maxCoeff());
    EXPECT_LT(worst, 1e-3 * peak_e) << by;
    EXPECT_NEAR(after.sum() / before.sum(), 1, 1e-4) << by;
  }
}

TEST(Panorama, ALongPanelContinuesAtTheOtherEnd) {
  // Seen from near one end, a panel of 8 m reaches 156 degrees beyond its centre.
  Scene scene = walls();
  scene.lamps.resize(1);
  Lamp& panel = scene.lamps[0];
  panel.shape = LampShape::rectangle;
  panel.size_m = {8, 0.2};
  panel.centre_m = {1.5, 0, 0.4};
  for (const double side : {-1, 1}) {
    panel.centre_m.x() = side * 1.5;
    const double peak_e = 1.1 * peak_electrons(scene, turned(0));
    const Eigen::MatrixXd before = mean_electrons(scene, turned(0), peak_e);
    for (int by = 25; by < columns; by += 25) {
      const Eigen::MatrixXd after = mean_electrons(scene, turned(by), peak_e);
      EXPECT_NEAR(after.sum() / before.sum(), 1, 1e-3) << side << " " << by;
    }
  }
}

TEST(Panorama, TheTruthOfALampAtTheSeamIsThatOfTheWholeLamp) {
  const Scene scene = walls();
  const Rendered before = simulate(scene, turned(0), noiseless());
  for (const double by : {178.0, 182.0}) {
    const Rendered after = simulate(scene, turned(by), noiseless());
    for (int i = 0; i < 2; ++i) {
      EXPECT_NEAR(after.lamps[i].electrons / before.lamps[i].electrons, 1, 1e-4) << by;
      const double moved = after.lamps[i].centre_px.x() - before.lamps[i].centre_px.x() - by;
      EXPECT_NEAR(std::remainder(moved, columns), 0, 1e-6) << by;
      EXPECT_GT(after.lamps[i].centre_px.x(), -0.5);
      EXPECT_LT(after.lamps[i].centre_px.x(), columns - 0.5);
    }
  }
}

}  // namespace
}  // namespace occ::test
