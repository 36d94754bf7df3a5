// SPDX-License-Identifier: Apache-2.0
// The fixed-lag smoother: it is the batch while all poses are in the window, a filter beyond, and
// takes frames that are late, twice there, lost, or of a body that was carried away.
#include "libocc/smooth/window_smoother.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "libocc/smooth/consistency.hpp"
#include "tests/smooth/smoother_support.hpp"

namespace occ::test {
namespace {

WindowOptions window_of(int poses) {
  WindowOptions options;
  options.poses = poses;
  return options;
}

WindowSmoother::Estimate fed(WindowSmoother& smoother, const Drive& drive, std::size_t k) {
  if (k > 0) smoother.add_odometry(drive.input.odometry[k - 1]);
  return smoother.add_frame(drive.input.frames[k]);
}

double sigmas_off(const Rigid3& truth, const SmoothedPose& found) {
  return std::sqrt(
      normalised_squared_error(difference(truth, found.body_from_world), found.covariance));
}

TEST(WindowSmoother, IsTheBatchWhileAllPosesAreInIt) {
  const Drive drive = room_drive(31, 8);
  WindowSmoother smoother(window_of(8));
  WindowSmoother::Estimate last;
  for (std::size_t k = 0; k < 8; ++k) last = fed(smoother, drive, k);
  const auto batch = smooth(drive.input);
  ASSERT_TRUE(last.ok()) << last.message;
  ASSERT_EQ(last->window.poses.size(), 8u);
  EXPECT_NEAR(last->window.chi2, batch->chi2, 1e-9 * batch->chi2);
  for (std::size_t k = 0; k < 8; ++k) {
    const SmoothedPose &a = last->window.poses[k], &b = batch->poses[k];
    EXPECT_LT(difference(a.body_from_world, b.body_from_world).norm(), 1e-8);
    EXPECT_LT((a.covariance - b.covariance).norm(), 1e-6 * b.covariance.norm());
  }
}

// Everything before the window is in its prior: the newest pose is that of a batch over all frames
// so far, as far as the problem is linear.
TEST(WindowSmoother, RemembersWhatItForgot) {
  const Drive drive = room_drive(32, 25);
  WindowSmoother smoother(window_of(4));
  for (std::size_t k = 0; k < 25; ++k) {
    const auto now = fed(smoother, drive, k);
    ASSERT_TRUE(now.ok()) << now.message;
    ASSERT_LE(now->window.poses.size(), 4u);
    if (k % 6 != 0) continue;
    SmootherInput so_far;
    so_far.frames.assign(drive.input.frames.begin(),
                         drive.input.frames.begin() + static_cast<std::ptrdiff_t>(k) + 1);
    so_far.odometry.assign(drive.input.odometry.begin(),
                           drive.input.odometry.begin() + static_cast<std::ptrdiff_t>(k));
    const auto batch = smooth(so_far);
    const SmoothedPose& newest = batch->poses.back();
    EXPECT_LT(sigmas_off(newest.body_from_world, now->newest), 0.02) << k;
    EXPECT_LT((now->newest.covariance - newest.covariance).norm(), 0.02 * newest.covariance.norm());
  }
}

TEST(WindowSmoother, IsConsistent) {
  constexpr int runs = 30, poses = 25;
  Eigen::MatrixXd squared(runs, poses), planar(runs, poses);
  for (int run = 0; run < runs; ++run) {
    const Drive drive = room_drive(static_cast<std::uint64_t>(500 + run), poses);
    const PlanarDrive floor = planar_drive(static_cast<std::uint64_t>(600 + run), poses);
    WindowSmoother smoother(window_of(5));
    PlanarWindowSmoother flat(window_of(5), floor.input.height_m);
    for (int k = 0; k < poses; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const auto now = fed(smoother, drive, i);
      squared(run, k) = std::pow(sigmas_off(drive.truth[i], now->newest), 2);
      if (k > 0) flat.add_odometry(floor.input.odometry[i - 1]);
      const auto there = flat.add_frame(floor.input.frames[i]);
      planar(run, k) = normalised_squared_error(difference(floor.truth[i], there->newest.pose),
                                                there->newest.covariance);
    }
  }
  const auto spatial = nees(squared, Eigen::MatrixXi::Constant(runs, poses, 6), 0.99);
  EXPECT_EQ(spatial.verdict, Consistency::consistent) << spatial.mean;
  const auto flat = nees(planar, Eigen::MatrixXi::Constant(runs, poses, 3), 0.99);
  EXPECT_EQ(flat.verdict, Consistency::consistent) << flat.mean;
}

TEST(WindowSmoother, TakesFramesAndOdometryThatAreLate) {
  const Drive drive = room_drive(33, 8);
  WindowSmoother in_order(window_of(8)), late(window_of(8));
  WindowSmoother::Estimate expected;
  for (std::size_t k = 0; k < 8; ++k) expected = fed(in_order, drive, k);
  for (const std::size_t k : {0u, 1u, 3u, 4u}) late.add_frame(drive.input.frames[k]);
  for (const Odometry& odometry : drive.input.odometry) EXPECT_TRUE(late.add_odometry(odometry));
  for (const std::size_t k : {2u, 5u, 7u}) late.add_frame(drive.input.frames[k]);
  const auto now = late.add_frame(drive.input.frames[6]);
  ASSERT_TRUE(now.ok()) << now.message;
  ASSERT_EQ(now->window.poses.size(), 8u);
  EXPECT_EQ(now->newest.time_s, expected->newest.time_s);
  for (std::size_t k = 0; k < 8; ++k)
    EXPECT_LT(
        difference(now->window.poses[k].body_from_world, expected->window.poses[k].body_from_world)
            .norm(),
        1e-8);
}

TEST(WindowSmoother, ARepeatedTimeIsASecondCamera) {
  const Drive drive = room_drive(34, 3);
  WindowSmoother smoother;
  const auto one = fed(smoother, drive, 0);
  const auto two = fed(smoother, drive, 0);
  EXPECT_EQ(two->window.poses.size(), 1u);
  EXPECT_LT(two->newest.covariance.trace(), 0.6 * one->newest.covariance.trace());
}

TEST(WindowSmoother, SaysThatAFrameIsBeforeTheWindow) {
  Drive drive = room_drive(35, 8);
  WindowSmoother smoother(window_of(3));
  WindowSmoother::Estimate before;
  for (std::size_t k = 0; k < 8; ++k) before = fed(smoother, drive, k);
  SmootherFrame old = drive.input.frames[1];
  const auto now = smoother.add_frame(old);
  EXPECT_FALSE(now->used);
  EXPECT_NE(now.message.find("before the window's oldest pose"), std::string::npos);
  EXPECT_LT(difference(now->newest.body_from_world, before->newest.body_from_world).norm(), 1e-9);
  EXPECT_FALSE(smoother.add_odometry(drive.input.odometry[2]));
  smoother.restart();
  EXPECT_TRUE(smoother.add_frame(old)->used);
}

TEST(WindowSmoother, FollowsTheLampsWhenCarriedAway) {
  Drive drive = room_drive(36, 24);
  const Drive elsewhere = room_drive(36, 44);
  for (std::size_t k = 12; k < 24; ++k) {  // the wheels tell nothing of it
    drive.truth[k] = elsewhere.truth[k + 20];
    drive.input.frames[k].sightings = elsewhere.input.frames[k + 20].sightings;
    if (k > 12)
      drive.input.odometry[k - 1].to_from_from = elsewhere.input.odometry[k + 19].to_from_from;
  }
  ASSERT_GT(position_error_m(drive.truth[11], drive.truth[12]), 0.4);
  WindowSmoother smoother;
  for (std::size_t k = 0; k < 24; ++k) {
    const auto now = fed(smoother, drive, k);
    EXPECT_LT(sigmas_off(drive.truth[k], now->newest), 6) << k << now.message;
    if (k != 12) continue;
    EXPECT_NE(now.message.find("odometry from 1.1 s to 1.2 s is contradicted"), std::string::npos)
        << now.message;
  }
}

TEST(WindowSmoother, LivesThroughDarkness) {
  Drive drive = room_drive(37, 40);
  for (std::size_t k = 10; k < 30; ++k) drive.input.frames[k].sightings.clear();
  for (std::size_t k = 20; k < 22; ++k)
    drive.input.frames[k].sightings = {room_drive(37, 40).input.frames[k].sightings[0]};
  WindowSmoother smoother(window_of(5));
  double dark = 0;
  for (std::size_t k = 0; k < 40; ++k) {
    const auto now = fed(smoother, drive, k);
    ASSERT_TRUE(now.ok()) << k << now.message;
    EXPECT_LT(sigmas_off(drive.truth[k], now->newest), 6) << k;
    dark = std::max(dark, now->newest.covariance.trace());
    if (k == 39) {
      EXPECT_LT(now->newest.covariance.trace(), 0.1 * dark);
    }
  }
}

TEST(WindowSmoother, FindsItselfWhenOdometryIsMissingToo) {
  Drive drive = room_drive(38, 30);
  for (std::size_t k = 10; k < 14; ++k) drive.input.frames[k].sightings.clear();
  WindowSmoother smoother(window_of(4));
  for (std::size_t k = 0; k < 30; ++k) {
    if (k > 0 && k != 11) smoother.add_odometry(drive.input.odometry[k - 1]);
    const auto now = smoother.add_frame(drive.input.frames[k]);
    EXPECT_FALSE(now->newest.covariance.hasNaN());
    if (k >= 11 && k < 14) {
      EXPECT_FALSE(now.ok());
      EXPECT_FALSE(now->newest.determined);
    }
    if (k >= 14) {
      EXPECT_LT(sigmas_off(drive.truth[k], now->newest), 6) << k << now.message;
    }
  }
}

TEST(WindowSmoother, StartsAgainAfterAClockJump) {
  Drive drive = room_drive(39, 20);
  for (std::size_t k = 10; k < 20; ++k) drive.input.frames[k].time_s += 5000;
  for (std::size_t k = 10; k < 19; ++k) {
    drive.input.odometry[k].from_s += 5000;
    drive.input.odometry[k].to_s += 5000;
  }
  drive.input.odometry[9].to_s -= 1e-3;  // ends before the jump
  WindowSmoother smoother;
  for (std::size_t k = 0; k < 20; ++k) {
    const auto now = fed(smoother, drive, k);
    ASSERT_TRUE(now.ok()) << now.message;
    EXPECT_LT(sigmas_off(drive.truth[k], now->newest), 6) << k;
  }
}

TEST(WindowSmoother, MemoryOfOdometryIsBounded) {
  WindowSmoother smoother;
  Odometry odometry;
  odometry.to_from_from.translation.x() = -1e-4;
  odometry.covariance = part_covariance(1e-6, 1e-6);
  const Drive drive = room_drive(40, 1);
  smoother.add_frame(drive.input.frames[0]);
  constexpr int pieces = 20000;  // paired up again and again
  for (int i = 0; i < pieces; ++i) {
    odometry.from_s = 1e-3 * i;
    odometry.to_s = 1e-3 * (i + 1);
    ASSERT_TRUE(smoother.add_odometry(odometry));
  }
  SmootherFrame frame;
  frame.time_s = 1e-3 * pieces;
  const auto now = smoother.add_frame(frame);
  ASSERT_TRUE(now.ok()) << now.message;
  const Rigid3 moved = now->newest.body_from_world * now->window.poses[0].body_from_world.inverse();
  EXPECT_NEAR(moved.translation.x(), -1e-4 * pieces, 1e-9);
}

TEST(WindowSmoother, BadInputThrows) {
  EXPECT_NE(complaint([] { WindowSmoother smoother(window_of(1)); }), "");
  WindowSmoother smoother;
  SmootherFrame frame;
  frame.time_s = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(complaint([&] { smoother.add_frame(frame); }).rfind("time_s must be finite", 0), 0u);
  Odometry odometry;
  EXPECT_EQ(complaint([&] {
              smoother.add_odometry(odometry);
            }).rfind("odometry.to_s must be finite and after from_s", 0),
            0u);
}

}  // namespace
}  // namespace occ::test
