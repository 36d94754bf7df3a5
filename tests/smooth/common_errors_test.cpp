// SPDX-License-Identifier: Apache-2.0
// Errors of map, camera, mounting and clock that are stated do not average away in smoothers.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "libocc/smooth/window_smoother.hpp"
#include "tests/smooth/smoother_support.hpp"
#include "tests/support/nees.hpp"

namespace occ::test {
namespace {

struct World {
  double map_m = 0, mount_rad = 0, mount_m = 0, clock_s = 0, focal_px = 0;
};

/// A drive whose map, camera, mounting and clock differ from the input of the smoother.
Drive drive_in(const World& world, std::uint64_t seed, int poses, bool states) {
  Drive drive = room_drive(seed, poses, 0);
  Random random(seed, 11);
  const Scene scene = irregular_room();
  std::vector<Eigen::Vector3d> lamps;
  for (const Lamp& lamp : scene.lamps)
    lamps.push_back(lamp.centre_m + world.map_m * random_vector(random));
  const double longer = 1 + world.focal_px * random.normal() / scene.camera.matrix()(0, 0);
  const Eigen::Matrix3d k = scene.camera.matrix();
  const Camera seen_by = Camera::pinhole(scene.camera.width(), scene.camera.height(),
                                         longer * k(0, 0), k(1, 1), k(0, 2), k(1, 2));
  const Camera plain = Camera::pinhole(scene.camera.width(), scene.camera.height(), k(0, 0),
                                       k(1, 1), k(0, 2), k(1, 2));
  const Vector6 mount = random_part(random, world.mount_rad, world.mount_m);
  const double late_s = world.clock_s * random.normal();
  for (std::size_t i = 0; i < drive.input.frames.size(); ++i) {
    SmootherFrame& frame = drive.input.frames[i];
    const Rigid3 at = room_pose(static_cast<double>(i) + late_s / 0.1);
    const Rigid3 camera = perturb(frame.cam_from_body, mount);
    frame.camera = states && world.focal_px > 0
                       ? plain.with_parameter_sigmas({{"fx_px", world.focal_px}})
                       : plain;
    for (std::size_t j = 0; j < lamps.size(); ++j) {
      PointSighting seen = sighting(seen_by, camera * at, lamps[j], 0.3, &random);
      seen.point_in_world = scene.lamps[j].centre_m;
      if (states)
        seen.point_covariance_m2 = world.map_m * world.map_m * Eigen::Matrix3d::Identity();
      frame.sightings[j] = seen;
    }
  }
  for (Odometry& odometry : drive.input.odometry)
    odometry.to_from_from = perturb(odometry.to_from_from, random_part(random, 0.004, 0.005));
  return drive;
}

SmootherOptions stated(const World& world, bool states) {
  SmootherOptions options;
  if (!states) return options;
  options.mount_sigma_rad = world.mount_rad;
  options.mount_sigma_m = world.mount_m;
  options.clock_sigma_s = world.clock_s;
  return options;
}

/// Mean of e^T P^-1 e / 6 of the pose in the middle of batches, and of the newest of windows.
struct Nees {
  double batch = 0, window = 0;
  int ok = 0;
};

Nees nees_in(const World& world, int runs, bool states = true) {
  constexpr int poses = 24;
  Nees sum;
  for (int run = 0; run < runs; ++run) {
    const Drive drive = drive_in(world, static_cast<std::uint64_t>(run), poses, states);
    const auto found = smooth(drive.input, stated(world, states));
    WindowOptions options;
    options.poses = 5;
    options.smoothing = stated(world, states);
    WindowSmoother window(options);
    WindowSmoother::Estimate newest;
    for (int k = 0; k < poses; ++k) {
      if (k > 0) window.add_odometry(drive.input.odometry[static_cast<std::size_t>(k - 1)]);
      newest = window.add_frame(drive.input.frames[static_cast<std::size_t>(k)]);
    }
    sum.ok += found.ok() && newest.ok();
    const SmoothedPose& middle = found->poses[poses / 2];
    sum.batch +=
        test::nees(difference(drive.truth[poses / 2], middle.body_from_world), middle.covariance) /
        (6 * runs);
    sum.window += test::nees(difference(drive.truth.back(), newest->newest.body_from_world),
                             newest->newest.covariance) /
                  (6 * runs);
  }
  return sum;
}

const std::map<std::string, World> worlds = {
    {"map", {0.01}},
    {"mount", {0, 0.005, 0.005}},
    {"clock", {0, 0, 0, 0.03}},
    {"camera", {0, 0, 0, 0, 5}},
    {"all", {0.005, 0.003, 0.003, 0.02, 3}},
};

void expect_consistent(int runs, double tolerance) {
  for (const auto& [name, world] : worlds) {
    const Nees nees = nees_in(world, runs);
    SCOPED_TRACE(name + ": " + std::to_string(nees.batch) + ", " + std::to_string(nees.window));
    EXPECT_EQ(nees.ok, runs);
    EXPECT_NEAR(nees.batch, 1, tolerance);
    EXPECT_NEAR(nees.window, 1, tolerance);
  }
}

TEST(SmootherErrors, CovarianceHoldsWhereTheyAreStated) { expect_consistent(20, 0.6); }

// With a late clock the velocity counts as constant, here at 0.9 m/s^2 for 30 ms: 1.15 and 1.19.
TEST(SlowSmootherErrors, CovarianceHoldsWhereTheyAreStated) { expect_consistent(400, 0.22); }

TEST(SmootherErrors, UnstatedTheyAreManySigmas) {
  for (const auto& [name, world] : worlds) {
    const Nees nees = nees_in(world, 4, false);
    EXPECT_GT(nees.batch, 5) << name;
  }
}

TEST(SmootherErrors, MorePicturesDoNotMakeTheMapExact) {
  World world;
  world.map_m = 0.01;
  const auto few = drive_in(world, 1, 10, true), many = drive_in(world, 1, 80, true);
  const auto sigma = [](const Drive& drive) {
    const auto found = smooth(drive.input);
    return std::sqrt(
        position_covariance(found->poses[5].body_from_world, found->poses[5].covariance).trace());
  };
  EXPECT_GT(sigma(many), 0.8 * sigma(few));
  EXPECT_GT(sigma(many), 0.004);  // of six lamps with 10 mm each
}

TEST(SmootherErrors, SightingsOfOnePointHaveOneErrorInWindowsOfAnyLength) {
  World world;
  world.map_m = 0.01;
  const Drive drive = drive_in(world, 2, 30, true);
  std::vector<double> sigmas;
  for (const int poses : {2, 5, 40}) {
    WindowOptions options;
    options.poses = poses;
    WindowSmoother window(options);
    WindowSmoother::Estimate now;
    for (std::size_t k = 0; k < drive.truth.size(); ++k) {
      if (k > 0) window.add_odometry(drive.input.odometry[k - 1]);
      now = window.add_frame(drive.input.frames[k]);
    }
    sigmas.push_back(std::sqrt(now->newest.covariance.trace()));
  }
  EXPECT_NEAR(sigmas[0], sigmas[2], 0.02 * sigmas[2]);
  EXPECT_NEAR(sigmas[1], sigmas[2], 0.02 * sigmas[2]);
}

TEST(SmootherErrors, ObservationsShareTheErrorsOfOneNumber) {
  // Ten observed poses, each with the same error of 20 mm along x and noise of 1 mm.
  SmootherInput input;
  SmootherOptions options;
  options.walk_m = options.walk_rad = 1e-4;
  for (int k = 0; k < 10; ++k) {
    auto seen = PoseObservation::of_pose(k, {}, part_covariance(1e-3, 1e-3));
    seen.systematic = {7};
    seen.gradient_by_systematic = 0.02 * seen.information.col(3);
    input.observations.push_back(seen);
  }
  const auto found = smooth(input, options);
  ASSERT_TRUE(found.ok()) << found.message;
  EXPECT_NEAR(std::sqrt(found->poses[4].covariance(3, 3)), 0.02, 2e-4);
  EXPECT_NEAR(std::sqrt(found->poses[4].covariance(4, 4)), 1e-3 / std::sqrt(10), 1e-4);
}

TEST(SmootherErrors, OnAFloor) {
  PlanarDrive drive = planar_drive(3, 20);
  const auto exact = smooth_planar(drive.input);
  for (SmootherFrame& frame : drive.input.frames)
    for (PointSighting& seen : frame.sightings)
      seen.point_covariance_m2 = 1e-4 * Eigen::Matrix3d::Identity();
  SmootherOptions options;
  options.mount_sigma_rad = 0.01;
  const auto found = smooth_planar(drive.input, options);
  ASSERT_TRUE(exact.ok() && found.ok()) << found.message;
  // A mounting turned by 10 mrad turns the heading by as much.
  EXPECT_NEAR(std::sqrt(found->poses[10].covariance(2, 2)), 0.01, 0.003);
  EXPECT_GT(found->poses[10].covariance(0, 0), 100 * exact->poses[10].covariance(0, 0));
}

TEST(SmootherErrors, InvalidOnesAreNamed) {
  Drive drive = room_drive(9, 2);
  drive.input.frames[1].sightings[3].point_covariance_m2(0, 0) = -1;
  try {
    smooth(drive.input);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("frames[1].sightings[3].point_covariance_m2"),
              std::string::npos)
        << error.what();
  }
  SmootherOptions options;
  options.clock_sigma_s = -1;
  EXPECT_THROW(options.validate(), std::invalid_argument);
}

}  // namespace
}  // namespace occ::test
