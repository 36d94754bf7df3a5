// SPDX-License-Identifier: Apache-2.0
// Tracker::planar: the pose of a vehicle on a floor, and when there is none.
#include <gtest/gtest.h>

#include "libocc/geometry/motion.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"

namespace occ {
namespace {

constexpr double frame_s = 1.0 / 30;

/// Pose of a camera on a vehicle that looks up.
Rigid3 upright(double x, double y, double heading) {
  return look_at({0, 0, 0.4}, {0, 0, 1}, {0, 1, 0}) * body_from_world({x, y, heading});
}

Image image_of(Renderer& renderer, const Rigid3& pose, std::uint32_t frame) {
  SimulateOptions options;
  options.seed = 1;
  options.frame = frame;
  Rendered rendered;
  renderer.render(pose, options, rendered);
  return rendered.image;
}

TEST(TrackerPlanar, IsKnownOnlyWhileTheTrackerTracks) {
  Scene scene = read_scene(std::string(LIBOCC_DATA) + "/scenes/irregular_six.yaml");
  Renderer lit(scene);
  TrackerOptions options;
  options.floor.emplace();
  Tracker tracker(scene, options, upright(0, 0, 0));
  EXPECT_FALSE(tracker.planar(0));  // searching
  double time_s = 0;
  for (std::uint32_t i = 0; i < 10; ++i, time_s += frame_s)
    tracker.add_image(image_of(lit, upright(1.6 + 0.01 * i, 2, 0), i).view(), time_s);
  const std::optional<PlanarEstimate> known = tracker.planar(time_s);
  ASSERT_TRUE(known);
  EXPECT_NEAR(known->pose.x_m, 1.7, 0.01);
  EXPECT_NEAR(known->pose.y_m, 2, 0.01);
  EXPECT_NEAR(known->pose.heading_rad, 0, 0.01);

  for (Lamp& lamp : scene.lamps) lamp.power_w = 1e-9;
  Renderer dark(scene);
  for (std::uint32_t i = 10; tracker.state() != TrackerState::lost && i < 200; ++i) {
    time_s += options.coast_s / 5;
    tracker.add_image(image_of(dark, upright(1.7, 2, 0), i).view(), time_s);
  }
  EXPECT_EQ(tracker.state(), TrackerState::lost);
  EXPECT_FALSE(tracker.planar(time_s));
}

TEST(TrackerPlanar, IsUnknownInSpace) {
  const Scene scene = read_scene(std::string(LIBOCC_DATA) + "/scenes/irregular_six.yaml");
  Renderer lit(scene);
  Tracker tracker(scene);
  const TrackedFrame frame = tracker.add_image(image_of(lit, upright(1.6, 2, 0), 0).view(), 0);
  ASSERT_EQ(frame.state, TrackerState::tracking);
  EXPECT_TRUE(tracker.predict(frame_s));
  EXPECT_FALSE(tracker.planar(frame_s));
}

}  // namespace
}  // namespace occ
