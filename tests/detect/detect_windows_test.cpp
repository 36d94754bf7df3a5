// SPDX-License-Identifier: Apache-2.0
// Detection in parts of an image.
#include "libocc/detect/detect_windows.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

// A window has few background meshes, and a lamp may cover most of them.
TEST(DetectInWindows, FindsALampInWindowsOfAnySize) {
  occ::Scene scene = occ::test::irregular_room();
  scene.lamps.resize(1);
  scene.room.reset();
  occ::Random random(1);
  for (int i = 0; i < 120; ++i) {
    const int half = i < 40 ? 50 + 3 * i : 87;  // three meshes across
    const Eigen::Vector3d position(random.uniform(0.6, 1.2), random.uniform(0.7, 1.3), 1.5);
    const occ::Rigid3 pose{Eigen::Matrix3d::Identity(), -position};
    const Eigen::Vector2d px = *scene.camera.project(pose * scene.lamps[0].centre_m);
    const occ::Rendered seen = occ::simulate(scene, pose);
    const int x = static_cast<int>(px.x()), y = static_cast<int>(px.y());
    const occ::WindowBlobs found =
        occ::detect_in_windows(seen.image.view(), {{x - half, y - half, x + half, y + half}});
    ASSERT_EQ(found.blobs.size(), 1u) << "window of " << 2 * half + 1;
    EXPECT_NEAR((found.blobs[0].centroid_px - seen.lamps[0].image_centre_px).norm(), 0, 0.2);
  }
}
