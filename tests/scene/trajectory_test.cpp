// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/trajectory.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "libocc/geometry/motion.hpp"
#include "libocc/geometry/so3.hpp"
#include "tests/support/simulate_support.hpp"
#include "tests/support/temporary_folder.hpp"

namespace {

using namespace occ;
using namespace occ::test;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Rigid3 random_pose(Random& random) {
  return {so3_exp(0.6 * random_vector(random)), random_vector(random)};
}

Trajectory random_trajectory(int count = 4, std::uint64_t seed = 3) {
  Random random(seed);
  std::vector<Waypoint> waypoints;
  double time_s = -1;
  for (int i = 0; i < count; ++i) {
    waypoints.push_back({time_s, random_pose(random)});
    time_s += 0.2 + random.uniform();
  }
  return Trajectory(waypoints);
}

double distance(const Rigid3& a, const Rigid3& b) {
  return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff();
}

TEST(Trajectory, PassesThroughItsWaypoints) {
  const Trajectory trajectory = random_trajectory();
  for (const Waypoint& w : trajectory.waypoints()) {
    EXPECT_LT(distance(trajectory.cam_from_world(w.time_s), w.cam_from_world), 1e-14);
    const double before = std::max(trajectory.begin_s(), w.time_s - 1e-9);
    EXPECT_LT(distance(trajectory.cam_from_world(before), w.cam_from_world), 1e-7);
  }
}

TEST(Trajectory, VelocityIsTheDerivativeOfTheLeftPerturbation) {
  const Trajectory trajectory = random_trajectory();
  const double h = 1e-5;
  for (double time_s = trajectory.begin_s() + 0.05; time_s < trajectory.end_s() - 0.05;
       time_s += 0.0913) {
    const Rigid3 here = trajectory.cam_from_world(time_s);
    const Vector6 numeric = (difference(trajectory.cam_from_world(time_s + h), here) -
                             difference(trajectory.cam_from_world(time_s - h), here)) /
                            (2 * h);
    if (trajectory.velocity(time_s - h) != trajectory.velocity(time_s + h)) continue;
    EXPECT_TRUE(jacobian_agrees(trajectory.velocity(time_s), numeric, 1e-7));
    EXPECT_FALSE(jacobian_agrees(1.001 * trajectory.velocity(time_s), numeric, 1e-7));
  }
}

TEST(Trajectory, MovesOnAScrew) {
  const Rigid3 from{so3_exp({0.3, 0.1, -0.2}), {1, 2, 3}};
  const Rigid3 to{so3_exp({-0.5, 0.4, 1.2}), {0.5, -1, 2}};
  const Trajectory trajectory({{10, from}, {12, to}});
  const Rigid3 half = trajectory.cam_from_world(11) * from.inverse();
  EXPECT_LT(distance(half * half * from, to), 1e-14);
  // The curve does not depend on its direction or on the world frame.
  const Trajectory back({{10, to}, {12, from}});
  EXPECT_LT(distance(back.cam_from_world(10.7), trajectory.cam_from_world(11.3)), 1e-13);
  const Rigid3 frame{so3_exp({0.7, -0.9, 0.4}), {-3, 1, 4}};
  const Trajectory elsewhere({{10, from * frame}, {12, to * frame}});
  EXPECT_LT(distance(elsewhere.cam_from_world(10.4), trajectory.cam_from_world(10.4) * frame),
            1e-13);
}

TEST(Trajectory, VelocityBetweenMovesOnePoseToTheOther) {
  const Trajectory trajectory = random_trajectory();
  const double from = trajectory.begin_s() + 0.1, to = trajectory.end_s() - 0.1;
  EXPECT_LT(distance(moved_pose(trajectory.cam_from_world(from), trajectory.velocity(from, to),
                                to - from),
                     trajectory.cam_from_world(to)),
            1e-13);
  EXPECT_EQ(trajectory.velocity(from, from), trajectory.velocity(from));
  EXPECT_EQ(trajectory.velocity(from, from + 1e-3), trajectory.velocity(from));
}

TEST(Trajectory, ASinglePoseHasZeroVelocity) {
  const Trajectory trajectory({{2, Rigid3{}}});
  EXPECT_EQ(trajectory.velocity(2), Vector6::Zero());
  EXPECT_EQ(trajectory.velocity(2, 2), Vector6::Zero());
  EXPECT_EQ(trajectory.cam_from_world(2).matrix(), Eigen::Matrix4d::Identity());
}

// A row of a rolling shutter, rendered with the frame's velocity, equals that of a still image at
// the pose of the trajectory in the middle of the row's exposure.
TEST(Trajectory, RowsAreRenderedAtThePosesOfTheTrajectory) {
  Scene scene;
  scene.camera = Camera::pinhole(80, 60, 200, 200, 39.5, 29.5);
  scene.lamps = {disc_lamp(0, {0.02, 0.03, 1.5})};
  scene.sensor.exposure_s = 1e-5;
  scene.sensor.row_time_s = 2e-4;
  scene.effects.set(Effect::motion_blur, Use::off);
  scene.validate();
  const Trajectory trajectory({{0, {so3_exp({0.01, 0, 0.1}), {0, 0, 0}}},
                               {0.1, {so3_exp({-0.3, 0.5, 0.4}), {0.3, 0, 0.1}}}});
  SimulateOptions options;
  options.noise = false;
  options.start_s = 0.013;
  const double end_s = 0.013 + 60 * 2e-4;
  options.velocity = trajectory.velocity(0.013, end_s);
  const Rendered rolling = simulate(scene, trajectory.cam_from_world(0.013), options);
  int lit = 0;
  for (int y = 0; y < 60; ++y) {
    const double seen_s = 0.013 + y * 2e-4 + 0.5e-5;
    options.velocity.setZero();
    const Rendered still = simulate(scene, trajectory.cam_from_world(seen_s), options);
    for (int x = 0; x < 80; ++x) {
      const auto i = static_cast<std::size_t>(y * 80 + x);
      EXPECT_NEAR(rolling.image.u8[i], still.image.u8[i], 1);
      lit += still.image.u8[i] > 50;
    }
  }
  EXPECT_GT(lit, 100);
}

TEST(TrajectoryFile, RoundTrip) {
  const Trajectory trajectory = random_trajectory(20);
  const Folder folder;
  const std::string path = (folder.path() / "walk.txt").string();
  write_trajectory(path, trajectory);
  const Trajectory again = read_trajectory(path);
  ASSERT_EQ(again.waypoints().size(), trajectory.waypoints().size());
  for (std::size_t i = 0; i < again.waypoints().size(); ++i) {
    EXPECT_EQ(again.waypoints()[i].time_s, trajectory.waypoints()[i].time_s);
    EXPECT_LT(
        distance(again.waypoints()[i].cam_from_world, trajectory.waypoints()[i].cam_from_world),
        4e-15);
  }
}

TEST(TrajectoryFile, ContainsTheCamerasPoseInTheWorld) {
  const Trajectory trajectory = parse_trajectory(
      "# a comment\n\n1.5 1 2 3 0 0 0.7071068 0.7071068 # a quarter turn about the world's Z\n");
  const Rigid3 pose = trajectory.cam_from_world(1.5);
  EXPECT_LT((pose.origin_in_source() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((pose * Eigen::Vector3d(1, 3, 3) - Eigen::Vector3d::UnitX()).norm(), 1e-6);
}

TEST(TrajectoryFile, ErrorsNameLineAndValue) {
  const auto why = [](const std::string& text) {
    return complaint<std::runtime_error>([&] { parse_trajectory(text, "walk.txt"); });
  };
  const std::string good = "0 0 0 0 0 0 0 1\n";
  EXPECT_EQ(why(""), "walk.txt: contains no pose");
  EXPECT_EQ(why(good + "1 0 0 0 0 0 0\n"),
            "walk.txt:2: must be 8 numbers, t tx ty tz qx qy qz qw, got 7");
  EXPECT_EQ(why(good + "#\n1 0 0 nan 0 0 0 1\n"), "walk.txt:3: must be finite numbers, got nan");
  EXPECT_EQ(why("1 0 0 0 0 0 zero 1\n"), "walk.txt:1: must be finite numbers, got zero");
  EXPECT_EQ(why(good + good), "walk.txt:2: times must increase, got 0 0 0 0 0 0 0 1");
  EXPECT_EQ(why("0 0 0 0 0 0 0 2\n"),
            "walk.txt:1: qx qy qz qw must be a unit quaternion, got norm 2");
  EXPECT_NE(complaint<std::runtime_error>([] { read_trajectory("/nowhere/walk.txt"); }), "");
}

TEST(TrajectoryFile, WaypointsInYaml) {
  const Trajectory trajectory = parse_trajectory(R"(# a walk
schema: libocc-trajectory/1
waypoints:
  - {time_s: 0, position_m: [1, 2, 0.4], heading_deg: 90}
  - {time_s: 1, position_m: [1, 2, 0.4], heading_deg: 30, tilt_deg: 10, tilt_towards_deg: 90}
  - {time_s: 2, position_m: [2, 2, 0.5], look_at_m: [2, 2.5, 3], up: [0, 1, 0]}
)");
  ASSERT_EQ(trajectory.waypoints().size(), 3u);
  EXPECT_EQ(trajectory.end_s(), 2);
  const Rigid3 level = trajectory.cam_from_world(0), tilted = trajectory.cam_from_world(1);
  EXPECT_LT((level.origin_in_source() - Eigen::Vector3d(1, 2, 0.4)).norm(), 1e-12);
  EXPECT_NEAR(heading_rad(level), std::acos(0.0), 1e-12);
  EXPECT_LT((level.rotation.row(2).transpose() - Eigen::Vector3d::UnitZ()).norm(), 1e-12);
  const double tilt = std::acos(-1.0) / 18;
  const Eigen::Vector3d axis(0, std::sin(tilt), std::cos(tilt));
  EXPECT_LT((tilted.rotation.row(2).transpose() - axis).norm(), 1e-12);
  EXPECT_LT(distance(trajectory.cam_from_world(2), look_at({2, 2, 0.5}, {2, 2.5, 3}, {0, 1, 0})),
            1e-12);
}

TEST(TrajectoryFile, ReadsEveryFileThatComesWithTheLibrary) {
  for (const char* name : {"walk", "standing", "phone_walk"})
    EXPECT_GT(read_trajectory(std::string(LIBOCC_DATA) + "/trajectories/" + name + ".yaml").end_s(),
              1);
}

TEST(TrajectoryFile, ErrorsInWaypointsNameKeyAndValue) {
  const auto why = [](const std::string& waypoints) {
    return complaint<std::runtime_error>([&] {
      parse_trajectory("schema: libocc-trajectory/1\nwaypoints: [" + waypoints + "]\n", "w.yaml");
    });
  };
  const std::string good = "{time_s: 0, position_m: [0, 0, 0]}";
  EXPECT_EQ(why(good), "");
  EXPECT_EQ(why(""), "w.yaml:2: key `waypoints`: must be a list of at least one, got a list of 0");
  EXPECT_EQ(why(good + ", " + good),
            "w.yaml:2: key `waypoints[1].time_s`: must be later than the previous one, got 0");
  EXPECT_EQ(why("{time_s: 0}"), "w.yaml:2: key `waypoints[0].position_m`: is missing");
  EXPECT_EQ(why("{time_s: 0, position_m: [0, 0, 0], up: [0, 0, 1]}"),
            "w.yaml:2: key `waypoints[0].up`: must be absent without `look_at_m`, got a list of 3");
  EXPECT_NE(why("{time_s: 0, position_m: [0, 0, 0], look_at_m: [0, 0, 0]}").find("look_at_m"),
            std::string::npos);
}

TEST(Trajectory, RejectsInvalidTrajectories) {
  const auto why = [](std::vector<Waypoint> waypoints) {
    return complaint([&] { Trajectory trajectory(waypoints); });
  };
  const Rigid3 pose;
  Rigid3 broken;
  broken.translation.x() = nan;
  EXPECT_EQ(why({}), "waypoints must be at least one, got 0");
  EXPECT_EQ(why({{1, pose}, {1, pose}}),
            "waypoints[1].time_s must be later than the previous one, got 1");
  EXPECT_EQ(why({{nan, pose}}), "waypoints[0].time_s must be finite, got nan");
  EXPECT_NE(why({{0, pose}, {1, broken}}).find("waypoints[1].cam_from_world must be finite"),
            std::string::npos);
  const Trajectory trajectory({{0, pose}, {1, pose}});
  EXPECT_NE(complaint([&] { trajectory.cam_from_world(1.01); }), "");
  EXPECT_NE(complaint([&] { trajectory.velocity(-0.01); }), "");
  EXPECT_NE(complaint([&] { trajectory.cam_from_world(nan); }), "");
  EXPECT_NE(complaint([&] { trajectory.velocity(0.6, 0.5); }), "");
}

}  // namespace
