// SPDX-License-Identifier: Apache-2.0
// Light of point lamps that walls reflect.
#include <gtest/gtest.h>

#include <Eigen/Core>

#include "tests/support/simulate_support.hpp"

namespace occ {
namespace {

/// A room of reflecting walls with one point lamp and a camera that sees ceiling and a wall.
Scene wall_scene() {
  Scene scene;
  scene.camera = Camera::pinhole(80, 60, 50, 50, 39.5, 29.5);
  scene.room = Room{{4, 4, 3}, 0.5};
  Lamp lamp = test::disc_lamp(0, {2, 2, 2.5});
  lamp.shape = LampShape::point;
  lamp.power_w = 10;
  scene.lamps = {lamp};
  scene.sensor.bit_depth = 16;
  scene.sensor.full_well_e = 1e9;
  scene.sensor.gain_dn_per_e = 0.5;
  scene.sensor.black_level_dn = 1000;
  scene.effects.set(Effect::interreflection, Use::off);
  scene.validate();
  return scene;
}

Eigen::MatrixXd wall_image(const Scene& scene) {
  const Rigid3 pose = look_at({1, 1, 0.5}, {3.5, 3.5, 2.6}, {0, 0, 1});
  const Image image = simulate(scene, pose, test::noiseless()).image;
  Eigen::MatrixXd values(image.width, image.height);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) values(x, y) = image.u16[y * image.width + x];
  return values;
}

TEST(WallLight, OfAPointLampDoesNotDependOnASize) {
  Scene scene = wall_scene();
  scene.lamps[0].size_m = {0.01, 0.01};
  const Eigen::MatrixXd small = wall_image(scene);
  EXPECT_GT(small.maxCoeff(), 1020);
  scene.lamps[0].size_m = {3, 3};
  scene.lamps[0].radius_m = 1;
  EXPECT_EQ((wall_image(scene) - small).norm(), 0);
}

TEST(WallLight, IsInTheDomainOfAFisheyeLensOnly) {
  Scene scene = wall_scene();
  scene.lamps[0].normal = {0, 0, -1};
  scene.camera = Camera::fisheye(80, 60, 12, 12, 39.5, 29.5);  // the corners are at 4 rad
  const Eigen::MatrixXd image = wall_image(scene);
  int inside = 0, outside = 0;
  for (int x = 0; x < 80; ++x)
    for (int y = 0; y < 60; ++y) {
      if (scene.camera.unproject({x, y})) {
        inside += image(x, y) > 1000;
        continue;
      }
      ++outside;
      EXPECT_EQ(image(x, y), 1000) << x << " " << y;
    }
  EXPECT_GT(outside, 500);
  EXPECT_GT(inside, 2000);
}

}  // namespace
}  // namespace occ
