// SPDX-License-Identifier: Apache-2.0
// Tracking of three lamps by their centres, which up to four poses fit: none of them may be taken
// for certain where two meet.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <optional>

#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

constexpr double frame_s = 1.0 / 30;

Scene three_lamps(Random& random) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  for (int i = 0; i < 3; ++i) {
    Lamp lamp;
    lamp.id = i;
    lamp.radius_m = 0.08;
    lamp.normal = -Eigen::Vector3d::UnitZ();
    const double angle = 2.1 * i + random.uniform(-0.4, 0.4);
    const double out_m = random.uniform(0.5, 0.8);
    lamp.centre_m = {out_m * std::cos(angle), out_m * std::sin(angle),
                     2.2 + random.uniform(-0.15, 0.15)};
    scene.lamps.push_back(lamp);
  }
  return scene;
}

Rigid3 pose_at(const Eigen::Vector3d& position, double heading) {
  const Eigen::Matrix3d rotation = so3_exp({0.05, -0.08, 0}) * so3_exp({0, 0, heading});
  return {rotation, -rotation * position};
}

TrackerOptions by_centres() {
  TrackerOptions options;
  options.locate.refine.rung = Rung::centres;
  return options;
}

TrackedFrame add_frame(Tracker& tracker, Renderer& renderer, const Rigid3& pose, int frame) {
  SimulateOptions options;
  options.seed = 1;
  options.frame = static_cast<std::uint32_t>(frame);
  options.noise_area = NoiseArea::around_lamps;
  Rendered rendered;
  renderer.render(pose, options, rendered);
  return tracker.add_image(rendered.image.view(), frame * frame_s);
}

double error_m(const TrackedFrame& frame, const Rigid3& truth) {
  return (frame.position_m - truth.origin_in_source()).norm();
}

TEST(TrackerBranches, APathThroughTheMeetingOfTwoBranchesIsNeverWrong) {
  constexpr int frames = 60;
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    Random random(2, seed);
    const Scene scene = three_lamps(random);
    Tracker tracker(scene, by_centres());
    Renderer renderer(scene);
    const double heading = random.uniform(-3, 3), direction = random.uniform(-3, 3);
    const Eigen::Vector3d along(std::cos(direction), std::sin(direction), 0);
    int tracked = 0;
    for (int frame = 0; frame < frames; ++frame) {
      const Rigid3 truth = pose_at((0.012 * frame - 0.36) * along, heading);
      const TrackedFrame seen = add_frame(tracker, renderer, truth, frame);
      if (seen.state != TrackerState::tracking) continue;
      ++tracked;
      const Vector6 off = difference(truth, seen.cam_from_world);
      EXPECT_LT(test::nees(off, seen.covariance), 150)
          << "seed " << seed << ", frame " << frame << ": " << error_m(seen, truth) << " m off";
    }
    EXPECT_GT(tracked, frames / 3) << seed;
  }
}

// Another pose from which the lamps have the same directions, far from the truth; none if `truth`
// is the only one.
std::optional<Rigid3> other_pose(const Scene& scene, const Rigid3& truth) {
  Eigen::Matrix3d bearings, points;
  for (int i = 0; i < 3; ++i) {
    points.col(i) = scene.lamps[i].centre_m;
    bearings.col(i) = (truth * scene.lamps[i].centre_m).normalized();
  }
  for (const Rigid3& pose : p3p(bearings, points))
    if (difference(pose, truth).norm() > 0.3) return pose;
  return std::nullopt;
}

TEST(TrackerBranches, AStartAtAnotherPoseThatFitsIsNoticedByTheSizes) {
  constexpr int frames = 25;
  int starts = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    Random random(5, seed);
    const Scene scene = three_lamps(random);
    const double heading = random.uniform(-3, 3), direction = random.uniform(-3, 3);
    const Eigen::Vector3d along(std::cos(direction), std::sin(direction), 0);
    const auto truth_at = [&](int frame) {
      return pose_at((0.1 + 0.003 * frame) * along, heading);
    };
    const std::optional<Rigid3> wrong = other_pose(scene, truth_at(0));
    if (!wrong) continue;
    ++starts;
    Vector6 sigmas;
    sigmas << 1e-3, 1e-3, 1e-3, 1e-2, 1e-2, 1e-2;
    Tracker tracker(scene, by_centres());
    tracker.start(0, *wrong, sigmas.cwiseAbs2().asDiagonal());
    Renderer renderer(scene);
    TrackedFrame seen;
    for (int frame = 1; frame < frames; ++frame)
      seen = add_frame(tracker, renderer, truth_at(frame), frame);
    EXPECT_EQ(seen.state, TrackerState::tracking) << "seed " << seed << ": " << seen.reason;
    const Vector6 off = difference(truth_at(frames - 1), seen.cam_from_world);
    EXPECT_LT(test::nees(off, seen.covariance), 40)
        << "seed " << seed << ": " << error_m(seen, truth_at(frames - 1)) << " m off";
  }
  EXPECT_GT(starts, 6);
}

}  // namespace
}  // namespace occ
