// SPDX-License-Identifier: Apache-2.0
// Lamps whose centres are so uncertain that the position of the camera is less certain than their
// distance.
#include <gtest/gtest.h>

#include "libocc/locate/locate.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// A square metre of lamps, three metres above the camera.
Result<Fix> with_sigma(double centroid_sigma_px) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  for (const Eigen::Vector2d& place :
       {Eigen::Vector2d(0, 0), {1.1, 0.1}, {0.2, 0.9}, {1.2, 1.0}, {0.6, 0.4}})
    scene.lamps.push_back(
        test::disc_lamp(static_cast<int>(scene.lamps.size()), {place.x(), place.y(), 3}));
  const Rigid3 pose = look_at({0.5, 0.5, 0.3}, {0.6, 0.5, 3}, {0, 1, 0});
  std::vector<Blob> blobs = test::exact_blobs(scene, pose, {0, 0, centroid_sigma_px});
  for (std::size_t i = 0; i < blobs.size(); ++i) blobs[i].lamp_id = scene.lamps[i].id;
  return locate(blobs, scene);
}

TEST(UnknownPosition, IsDegenerate) {
  const Result<Fix> sharp = with_sigma(0.5);
  EXPECT_TRUE(sharp.ok()) << sharp.message;
  const Result<Fix> vague = with_sigma(25);
  EXPECT_EQ(vague.status, Status::degenerate) << vague.message;
  EXPECT_NE(vague.message.find("exceeds their distance, 2."), std::string::npos) << vague.message;
  EXPECT_FALSE(vague->candidates.empty());
}

}  // namespace
}  // namespace occ
