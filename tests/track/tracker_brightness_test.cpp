// SPDX-License-Identifier: Apache-2.0
// A blob in a lamp's window is compared with the lamp's brightness in the images before: a faint
// step of the background is no lamp, and a lamp that is dimmed, near or saturated still is.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

constexpr double frame_s = 1.0 / 30;
constexpr int dark_lamp = 4;

Scene six_lamps() { return read_scene(std::string(LIBOCC_DATA) + "/scenes/irregular_six.yaml"); }

Rigid3 upright(double x) {
  return look_at({0, 0, 0.4}, {0, 0, 1}, {0, 1, 0}) * body_from_world({x, 2, 0});
}

Image rendered(const Scene& scene, const Rigid3& pose, int frame) {
  SimulateOptions options;
  options.seed = 1;
  options.frame = static_cast<std::uint32_t>(frame);
  options.noise_area = NoiseArea::around_lamps;
  options.start_s = frame * frame_s;
  Rendered out;
  Renderer(scene).render(pose, options, out);
  return out.image;
}

/// Adds grey levels to a square of the background.
void add_step(Image& image, const Eigen::Vector2d& centre, int half_px, int dn) {
  for (int y = -half_px; y <= half_px; ++y) {
    for (int x = -half_px; x <= half_px; ++x) {
      const auto at = static_cast<std::size_t>(std::lround(centre.y()) + y) *
                          static_cast<std::size_t>(image.width) +
                      static_cast<std::size_t>(std::lround(centre.x()) + x);
      image.u8[at] = static_cast<std::uint8_t>(std::min(255, image.u8[at] + dn));
    }
  }
}

Scene with_power(Scene scene, int lamp, double factor) {
  for (Lamp& one : scene.lamps)
    if (lamp < 0 || one.id == lamp) one.power_w *= factor;
  return scene;
}

bool is_missing(const TrackedFrame& frame, int lamp) {
  return std::count(frame.missing.begin(), frame.missing.end(), lamp) > 0;
}

TEST(TrackerBrightness, AFaintStepIsNotADarkLamp) {
  const Scene scene = six_lamps();
  const Scene dark = with_power(scene, dark_lamp, 1e-9);
  for (const int half_px : {2, 3, 4}) {
    Tracker tracker(scene);
    TrackedFrame frame;
    for (int i = 0; i < 20; ++i)
      frame = tracker.add_image(rendered(scene, upright(1.5), i).view(), i * frame_s);
    ASSERT_EQ(frame.lamps.count(dark_lamp), 1u);
    Image image = rendered(dark, upright(1.5), 20);
    const Eigen::Vector2d px =
        *scene.camera.project(upright(1.5) * scene.lamps[dark_lamp].centre_m);
    add_step(image, px, half_px, 4);
    frame = tracker.add_image(image.view(), 20 * frame_s);
    EXPECT_EQ(frame.state, TrackerState::tracking) << frame.reason;
    EXPECT_EQ(frame.lamps.count(dark_lamp), 0u) << half_px;
    EXPECT_TRUE(is_missing(frame, dark_lamp)) << half_px;
    frame = tracker.add_image(rendered(scene, upright(1.5), 21).view(), 21 * frame_s);
    EXPECT_EQ(frame.lamps.count(dark_lamp), 1u) << half_px;
  }
}

TEST(TrackerBrightness, ALampThatIsDimmedIsTheLamp) {
  const Scene scene = six_lamps();
  for (const double factor : {0.3, 3.0}) {
    Tracker tracker(scene);
    TrackedFrame frame;
    for (int i = 0; i < 12; ++i)
      frame = tracker.add_image(
          rendered(i < 10 ? scene : with_power(scene, dark_lamp, factor), upright(1.5), i).view(),
          i * frame_s);
    EXPECT_TRUE(frame.missing.empty()) << factor;
  }
}

/// A camera that shortens its exposure changes all lamps in one ratio, and saturated ones less.
TEST(TrackerBrightness, AChangeOfExposureRejectsNoLamp) {
  const Scene scene = six_lamps();
  for (const double factor : {0.05, 20.0}) {
    Scene other = scene;
    other.sensor.exposure_s *= factor;
    Tracker tracker(scene);
    for (int i = 0; i < 14; ++i) {
      const TrackedFrame frame =
          tracker.add_image(rendered(i < 10 ? scene : other, upright(1.5), i).view(), i * frame_s);
      EXPECT_EQ(frame.state, TrackerState::tracking) << factor << ' ' << i << frame.reason;
      EXPECT_TRUE(frame.missing.empty()) << factor << ' ' << i;
      EXPECT_EQ(frame.full_search, i == 0) << factor << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace occ
