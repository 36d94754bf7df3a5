// SPDX-License-Identifier: Apache-2.0
// Lamps that blink their ids slowly: in an image a lamp may be dark, or lit on some of its lines
// only. Neither may move the pose or start a full search.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/geometry/motion.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/scene/trajectory.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

constexpr double frame_s = 1.0 / 30;

Scene square() { return read_scene(std::string(LIBOCC_DATA) + "/scenes/ufsook_four.yaml"); }

/// Motion below the middle of the square at 0.5 m/s with rotation.
Trajectory walk() {
  const Rigid3 from = look_at({1.7, 2.0, 0.3}, {1.75, 2.05, 3}, {0, 1, 0});
  const Rigid3 to = look_at({2.4, 2.1, 0.32}, {2.3, 2.0, 3}, {0.3, 1, 0});
  return Trajectory({{0, from}, {1.5, to}});
}

Matrix6 loose() {
  Matrix6 covariance = Matrix6::Identity() * 0.02 * 0.02;
  covariance.diagonal().tail<3>().setConstant(0.05 * 0.05);
  return covariance;
}

struct Frame {
  Image image;
  Rigid3 truth;
  double time_s = 0;
};

std::vector<Frame> frames_of(const Scene& scene) {
  const Trajectory path = walk();
  Renderer renderer(scene);
  std::vector<Frame> frames;
  SimulateOptions options;
  options.seed = 1;
  options.noise_area = NoiseArea::around_lamps;
  for (int i = 0; i < 42; ++i) {
    const double time_s = i * frame_s;
    options.frame = static_cast<std::uint32_t>(i);
    options.start_s = time_s;
    options.velocity = path.velocity(time_s);
    Rendered rendered;
    renderer.render(path.cam_from_world(time_s), options, rendered);
    frames.push_back({rendered.image, path.cam_from_world(time_s), time_s});
  }
  return frames;
}

Vector6 off_by() {
  Vector6 delta;
  delta << 0.01, -0.015, 0.01, 0.03, -0.03, 0.02;
  return delta;
}

TEST(TrackerBlinking, DarkAndHalfLitLampsDoNotMoveThePose) {
  const Scene scene = square();
  const std::vector<Frame> frames = frames_of(scene);
  Tracker tracker(scene);
  tracker.start(0, perturb(frames.front().truth, off_by()), loose());
  int lamps = 0;
  double sum_m2 = 0;
  for (const Frame& frame : frames) {
    const TrackedFrame seen = tracker.add_image(frame.image.view(), frame.time_s);
    ASSERT_TRUE(seen.state == TrackerState::tracking || seen.state == TrackerState::coasting)
        << frame.time_s << ' ' << seen.reason;
    EXPECT_FALSE(seen.full_search) << frame.time_s << ' ' << seen.reason;
    EXPECT_TRUE(seen.missing.empty());  // a lamp that may be dark is not missing
    EXPECT_FALSE(seen.relocated);
    lamps += static_cast<int>(seen.lamps.size());
    if (frame.time_s < 0.3) continue;
    const double error_m = (seen.position_m - frame.truth.origin_in_source()).norm();
    EXPECT_LT(error_m, 0.04) << frame.time_s;
    sum_m2 += error_m * error_m;
    const Vector6 off = difference(frame.truth, seen.cam_from_world);
    EXPECT_LT(test::nees(off, seen.covariance), 30) << frame.time_s;
  }
  EXPECT_LT(std::sqrt(sum_m2 / 33), 0.012);
  EXPECT_GT(lamps, 50);   // about half of 4 x 42 are lit,
  EXPECT_LT(lamps, 110);  // and some of them on a part of their lines
}

TEST(TrackerBlinking, ALampCutByGoingOffIsNotTaken) {
  const Scene scene = square();
  for (const Frame& frame : frames_of(scene)) {
    Tracker tracker(scene);
    tracker.start(frame.time_s, perturb(frame.truth, 0.3 * off_by()), loose());
    const TrackedFrame seen = tracker.add_image(frame.image.view(), frame.time_s);
    for (const auto& [id, blob] : seen.lamps) {
      const int lines = blob.y1 - blob.y0 + 1, columns = blob.x1 - blob.x0 + 1;
      EXPECT_LT(std::abs(lines - columns), 6) << frame.time_s << ' ' << id;
    }
  }
}

TEST(TrackerBlinking, SteadyLampsAreSearchedForWhenThePredictionIsLoose) {
  const Scene scene = read_scene(std::string(LIBOCC_DATA) + "/scenes/irregular_six.yaml");
  const Rigid3 truth = look_at({1.7, 2.1, 0.5}, {1.8, 2.1, 3}, {0, 1, 0});
  SimulateOptions options;
  options.seed = 1;
  Renderer renderer(scene);
  Rendered rendered;
  renderer.render(truth, options, rendered);
  Matrix6 covariance = Matrix6::Identity() * 0.2 * 0.2;
  covariance.diagonal().tail<3>().setConstant(0.3 * 0.3);
  Tracker tracker(scene);
  tracker.start(0, perturb(truth, 3 * off_by()), covariance);
  const TrackedFrame seen = tracker.add_image(rendered.image.view(), 0);
  EXPECT_EQ(seen.state, TrackerState::tracking) << seen.reason;
  EXPECT_TRUE(seen.full_search);
  EXPECT_LT((seen.position_m - truth.origin_in_source()).norm(), 1e-3);
}

TEST(TrackerBlinking, AllDarkIsCoastingNotLost) {
  const Scene scene = square();
  const Frame first = frames_of(scene).front();
  Tracker tracker(scene);
  tracker.start(0, first.truth, loose());
  Image dark = first.image;
  std::fill(dark.u8.begin(), dark.u8.end(), std::uint8_t{2});
  const TrackedFrame seen = tracker.add_image(dark.view(), frame_s);
  EXPECT_EQ(seen.state, TrackerState::coasting);
  EXPECT_EQ(seen.reason, "every lamp that should be in view may be dark");
  EXPECT_FALSE(seen.full_search);
  EXPECT_EQ(tracker.add_image(dark.view(), 3).state, TrackerState::lost);
}

}  // namespace
}  // namespace occ
