// SPDX-License-Identifier: Apache-2.0
// States of the tracker and their limits: how long and how far it coasts, what it reports missing,
// how many images confirm a jump, and what remains known after the clock was set back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

constexpr double state_frame_s = 0.05;

Rigid3 looking_up(double x, double y = 2, double heading = 0) {
  const Rigid3 camera = look_at({0, 0, 0.4}, {0, 0, 1}, {0, 1, 0});
  return camera * body_from_world({x, y, heading});
}

/// Renders a room, with or without some of its lamps.
class StateWorld {
 public:
  explicit StateWorld(std::vector<int> dark_ids = {}) : renderer_(with_dark(dark_ids)) {}

  static Scene scene() {
    return read_scene(std::string(LIBOCC_DATA) + "/scenes/irregular_six.yaml");
  }

  const Image& image(const Rigid3& pose, double time_s) {
    SimulateOptions options;
    options.seed = 3;
    options.frame = frame_++;
    options.noise_area = NoiseArea::around_lamps;
    options.start_s = time_s;
    renderer_.render(pose, options, rendered_);
    return rendered_.image;
  }

 private:
  static Scene with_dark(const std::vector<int>& dark_ids) {
    Scene out = scene();
    for (Lamp& lamp : out.lamps)
      if (std::find(dark_ids.begin(), dark_ids.end(), lamp.id) != dark_ids.end())
        lamp.power_w = 1e-9;
    return out;
  }

  Renderer renderer_;
  Rendered rendered_;
  std::uint32_t frame_ = 0;
};

std::vector<int> all_ids() {
  std::vector<int> ids;
  for (const Lamp& lamp : StateWorld::scene().lamps) ids.push_back(lamp.id);
  return ids;
}

/// Tracks ten images of a camera at rest.
Tracker resting_tracker(const TrackerOptions& options, StateWorld& world) {
  Tracker tracker(StateWorld::scene(), options);
  for (int i = 0; i < 10; ++i) {
    const double t = i * state_frame_s;
    const TrackedFrame frame = tracker.add_image(world.image(looking_up(1.5), t).view(), t);
    EXPECT_EQ(frame.state, TrackerState::tracking) << frame.reason;
    if (i == 0) continue;  // found by the search
    EXPECT_GT(frame.nis_dof, 0);
    EXPECT_LT(frame.nis, 5 * frame.nis_dof) << i;
  }
  return tracker;
}

/// Number of images without any lamp until the tracker is lost.
int images_until_lost(const TrackerOptions& options) {
  StateWorld world, night(all_ids());
  Tracker tracker = resting_tracker(options, world);
  for (int i = 10; i < 200; ++i) {
    const double t = i * state_frame_s;
    const TrackedFrame frame = tracker.add_image(night.image(looking_up(1.5), t).view(), t);
    EXPECT_TRUE(frame.lamps.empty());
    EXPECT_EQ(frame.nis_dof, 0);
    if (frame.state == TrackerState::lost) return i - 10;
    EXPECT_EQ(frame.state, TrackerState::coasting);
    EXPECT_LT((frame.position_m - looking_up(1.5).origin_in_source()).norm(), 0.5);
  }
  return 200;
}

TEST(TrackerStates, ReportsTheTimesOfTheStepsOfASearchAndOfATrackedImage) {
  StateWorld world;
  Tracker tracker(StateWorld::scene());
  const TrackedFrame first = tracker.add_image(world.image(looking_up(2), 0).view(), 0);
  EXPECT_TRUE(first.full_search);
  EXPECT_GT(first.timing_s.detect_s, 0);
  EXPECT_GT(first.timing_s.identify_s, 0);
  EXPECT_GT(first.timing_s.refine_s, 0);
  EXPECT_LE(first.timing_s.detect_s + first.timing_s.identify_s + first.timing_s.refine_s,
            first.timing_s.total_s);
  const TrackedFrame second =
      tracker.add_image(world.image(looking_up(2), state_frame_s).view(), state_frame_s);
  EXPECT_FALSE(second.full_search);
  EXPECT_GT(second.timing_s.detect_s, 0);
  EXPECT_EQ(second.timing_s.identify_s, 0);
  EXPECT_GT(second.timing_s.refine_s, 0);
  EXPECT_LE(second.timing_s.detect_s + second.timing_s.refine_s, second.timing_s.total_s);
}

TEST(TrackerStates, CoastsForTheTimeOfTheOption) {
  TrackerOptions options;
  options.coast_sigma_m = 100;
  for (const double coast_s : {0.3, 0.6}) {
    options.coast_s = coast_s;
    EXPECT_NEAR(images_until_lost(options) * state_frame_s, coast_s, 1.01 * state_frame_s);
  }
}

TEST(TrackerStates, CoastsUntilThePositionIsTooUncertain) {
  // White acceleration q moves a body that is at rest by sqrt(q^2 t^3 / 3) along each axis.
  TrackerOptions options;
  options.coast_s = 100;
  options.filter.acceleration_noise = 0.2;
  options.filter.turn_acceleration_noise = 1e-3;
  options.coast_sigma_m = 0.2;
  const double expected_s = std::cbrt(3 * std::pow(options.coast_sigma_m / 0.2, 2));
  EXPECT_NEAR(images_until_lost(options) * state_frame_s, expected_s, 0.2 * expected_s);
}

TEST(TrackerStates, ReportsTheLampsThatShouldBeInView) {
  StateWorld world;
  Tracker tracker = resting_tracker({}, world);
  const TrackedFrame all =
      tracker.add_image(world.image(looking_up(1.5), 0.5).view(), 10 * state_frame_s);
  EXPECT_TRUE(all.missing.empty());
  ASSERT_GE(all.lamps.size(), 4u);
  const int gone = all.lamps.begin()->first;
  StateWorld one_dark({gone});
  const double t = 11 * state_frame_s;
  const TrackedFrame frame = tracker.add_image(one_dark.image(looking_up(1.5), t).view(), t);
  EXPECT_EQ(frame.state, TrackerState::tracking);
  EXPECT_EQ(frame.missing, std::vector<int>{gone});
  EXPECT_EQ(frame.lamps.count(gone), 0u);
  EXPECT_EQ(frame.lamps.size(), all.lamps.size() - 1);
  EXPECT_FALSE(frame.full_search);
}

TEST(TrackerStates, AJumpIsConfirmedByTheNumberOfTheOption) {
  for (const int confirmations : {1, 2, 4}) {
    TrackerOptions options;
    options.confirmations = confirmations;
    StateWorld world;
    Tracker tracker = resting_tracker(options, world);
    int images = 0;
    for (int i = 10; i < 20; ++i) {
      const double t = i * state_frame_s;
      const TrackedFrame frame =
          tracker.add_image(world.image(looking_up(2.5, 2.4, 0.8), t).view(), t);
      ++images;
      EXPECT_TRUE(frame.full_search);
      EXPECT_NE(frame.reason.find("from where it was expected"), std::string::npos);
      if (!frame.relocated) continue;
      EXPECT_LT((frame.position_m - looking_up(2.5, 2.4, 0.8).origin_in_source()).norm(), 0.02);
      break;
    }
    EXPECT_EQ(images, confirmations);
  }
}

TEST(TrackerStates, ImagesThatDisagreeConfirmNoJump) {
  StateWorld world;
  Tracker tracker = resting_tracker({}, world);
  for (int i = 10; i < 15; ++i) {  // later the prediction is uncertain
    const double t = i * state_frame_s;
    const Rigid3 pose = i % 2 == 0 ? looking_up(2.5, 2.4, 0.8) : looking_up(2.4, 1.5, -2);
    const TrackedFrame frame = tracker.add_image(world.image(pose, t).view(), t);
    EXPECT_FALSE(frame.relocated) << i;
    EXPECT_NE(frame.state, TrackerState::tracking) << i;
  }
}

TEST(TrackerStates, AClockThatIsSetBackWidensTheLastPose) {
  StateWorld world, night(all_ids());
  TrackerOptions options;
  options.drift_sigma_m = 0.2;
  options.drift_sigma_rad = 0.1;
  Tracker tracker = resting_tracker(options, world);
  TrackedFrame frame;
  for (int i = 0; i < 5; ++i) {
    const double t = -100 + i * state_frame_s;
    frame = tracker.add_image(night.image(looking_up(1.5), t).view(), t);
  }
  EXPECT_EQ(frame.state, TrackerState::coasting) << frame.reason;
  EXPECT_NEAR(std::sqrt(frame.covariance(0, 0)), 0.1, 0.01);
  EXPECT_NEAR(std::sqrt(frame.covariance(4, 4)), 0.2, 0.02);
  EXPECT_LT((frame.position_m - looking_up(1.5).origin_in_source()).norm(), 0.05);
}

TEST(TrackerStates, AClockThatIsSetBackIsThatOfAllCameras) {
  StateWorld world;
  Tracker tracker = resting_tracker({}, world);
  FrameSource second;
  second.camera = tracker.add_camera(StateWorld::scene(), Rigid3{});
  TrackedFrame frame = tracker.add_image(world.image(looking_up(1.5), 1).view(), 1, second);
  EXPECT_EQ(frame.state, TrackerState::tracking) << frame.reason;
  for (int i = 0; i < 5; ++i) {
    const double t = -100 + i * state_frame_s;
    frame = tracker.add_image(world.image(looking_up(1.5), t).view(), t);
  }
  EXPECT_NE(frame.reason.find("set back by"), std::string::npos) << frame.reason;
  const double next_s = -100 + 5 * state_frame_s;
  frame = tracker.add_image(world.image(looking_up(1.5), next_s).view(), next_s, second);
  EXPECT_EQ(frame.state, TrackerState::tracking) << frame.reason;
  EXPECT_EQ(frame.reason, "");
}

TEST(TrackerStates, AKnownStartIsTrackedWithoutASearch) {
  StateWorld world;
  Tracker tracker(StateWorld::scene());
  EXPECT_EQ(tracker.state(), TrackerState::searching);
  EXPECT_FALSE(tracker.predict(0));
  tracker.start(0, looking_up(1.5), 1e-4 * Matrix6::Identity());
  EXPECT_EQ(tracker.state(), TrackerState::coasting);
  ASSERT_TRUE(tracker.predict(0.01));
  const TrackedFrame frame = tracker.add_image(world.image(looking_up(1.51), 0.01).view(), 0.01);
  EXPECT_EQ(frame.state, TrackerState::tracking);
  EXPECT_FALSE(frame.full_search);
  EXPECT_LT((frame.position_m - looking_up(1.51).origin_in_source()).norm(), 0.01);
  // A start far from the truth: no lamp fits, and the search finds another pose.
  tracker.start(1, looking_up(2.6, 1.2, 2), 1e-4 * Matrix6::Identity());
  EXPECT_TRUE(tracker.add_image(world.image(looking_up(1.5), 1.01).view(), 1.01).full_search);
}

TEST(TrackerStates, AnImageOfAnotherCameraBeforeTheHistoryIsSkipped) {
  StateWorld world;
  TrackerOptions options;
  options.filter.history_s = 0.2;
  Tracker tracker(StateWorld::scene(), options);
  ASSERT_EQ(tracker.add_camera(StateWorld::scene(), {}), 1);
  for (int i = 0; i < 20; ++i) {
    const double t = i * state_frame_s;
    tracker.add_image(world.image(looking_up(1.5), t).view(), t);
  }
  const TrackedFrame late =
      tracker.add_image(world.image(looking_up(1.5), 0.1).view(), 0.1, {1, {}});
  EXPECT_NE(late.reason.find("older than the history"), std::string::npos) << late.reason;
  EXPECT_TRUE(late.lamps.empty());
  const TrackedFrame recent =
      tracker.add_image(world.image(looking_up(1.5), 0.9).view(), 0.9, {1, {}});
  EXPECT_EQ(recent.reason, "");
  EXPECT_EQ(recent.state, TrackerState::tracking);
  EXPECT_FALSE(recent.lamps.empty());
}

TEST(TrackerStates, OptionsAreCheckedByName) {
  const auto complaint = [](auto&& change) {
    TrackerOptions options;
    change(options);
    return test::complaint([&] { options.validate(); });
  };
  using O = TrackerOptions;
  EXPECT_EQ(complaint([](O&) {}), "");
  EXPECT_NE(complaint([](O& o) { o.coast_s = 0; }).find("coast_s"), std::string::npos);
  EXPECT_NE(complaint([](O& o) { o.gate_sigma = -1; }).find("gate_sigma"), std::string::npos);
  EXPECT_NE(complaint([](O& o) { o.drift_sigma_m = 0; }).find("drift_sigma_m"), std::string::npos);
  EXPECT_NE(complaint([](O& o) { o.drift_sigma_rad = std::nan(""); }).find("drift_sigma_rad"),
            std::string::npos);
  EXPECT_EQ(complaint([](O& o) { o.model_sigma_px = 0; }), "");
}

}  // namespace
}  // namespace occ
