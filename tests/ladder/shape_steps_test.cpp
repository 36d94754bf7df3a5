// SPDX-License-Identifier: Apache-2.0
// Methods that use the shapes of luminaires: exact without noise, and with noise as accurate as
// their papers' errors of centimetres suggest. One rectangle suffices for those that allow it.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/ladder/ladder.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Scene room_of(LampShape shape, double exponent = 2) {
  Scene scene = test::irregular_room();
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    Lamp& lamp = scene.lamps[i];
    lamp.shape = shape;
    lamp.radius_m = 0.2;
    if (shape == LampShape::disc) continue;
    lamp.size_m = i % 2 == 0 ? Eigen::Vector2d(0.4, 0.4) : Eigen::Vector2d(0.5, 0.2);
    lamp.x_axis = Eigen::Vector3d::UnitX();
    lamp.exponent = exponent;
  }
  scene.validate();
  return scene;
}

/// Measurements without noise: rims, corners, centres and brightness of all lamps.
LadderProblem exact_problem(const Scene& scene, const Rigid3& pose, std::size_t lamps) {
  LadderProblem p;
  p.scene = scene;
  p.scene.lamps.resize(lamps);
  p.truth = pose;
  const auto n = static_cast<Eigen::Index>(lamps);
  p.points_in_world.resize(3, n);
  p.points_px.resize(2, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Lamp& lamp = scene.lamps[static_cast<std::size_t>(i)];
    Blob blob;
    const auto rim = project_rim(lamp, pose, scene.camera, 40).value();
    for (const Eigen::Vector2d& px : rim) blob.rim.push_back({px, Eigen::Vector2d::UnitX(), 0.01});
    p.points_in_world.col(i) = lamp.centre_m;
    p.points_px.col(i) = blob.centroid_px = *scene.camera.project(pose * lamp.centre_m);
    blob.flux_dn =
        scene.sensor.gain_dn_per_e * lamp_electrons(lamp, pose, scene.camera, scene.sensor);
    if (lamp.shape == LampShape::rectangle) {
      const Eigen::Index at = p.corners_px.cols();
      p.corners_px.conservativeResize(2, at + 4);
      p.corners_in_world.conservativeResize(3, at + 4);
      const double signs[4][2] = {{1, 1}, {-1, 1}, {-1, -1}, {1, -1}};
      for (int k = 0; k < 4; ++k) {
        p.corners_in_world.col(at + k) =
            lamp.centre_m + 0.5 * signs[k][0] * lamp.size_m.x() * lamp.x_axis +
            0.5 * signs[k][1] * lamp.size_m.y() * lamp.normal.cross(lamp.x_axis);
        p.corners_px.col(at + k) = *scene.camera.project(pose * p.corners_in_world.col(at + k));
      }
    }
    p.matches.push_back({static_cast<int>(i), static_cast<int>(i)});
    p.blobs.push_back(std::move(blob));
  }
  p.sigma_px = 0.05;
  return p;
}

Rigid3 tilted_view() { return look_at({2.1, 1.7, 0.5}, {2.2, 2.0, 3.0}, {0.3, 1, 0}); }

double error_m(const LadderProblem& p, const char* name) {
  const LadderStep& step = ladder_step_named(name);
  EXPECT_TRUE(step.suits(p)) << name;
  const Result<Rigid3> pose = step.run(p);
  EXPECT_TRUE(pose.ok()) << name;
  return (pose->origin_in_source() - p.truth.origin_in_source()).norm() +
         (pose->rotation - p.truth.rotation).norm();
}

TEST(ShapeSteps, AreExactWithoutNoise) {
  const LadderProblem discs = exact_problem(room_of(LampShape::disc), tilted_view(), 6);
  for (const char* name : {"paa", "r_p3p", "lc_vlp"}) EXPECT_LT(error_m(discs, name), 1e-6) << name;
  const LadderProblem panels = exact_problem(room_of(LampShape::rectangle), tilted_view(), 6);
  for (const char* name : {"v_p4l", "corners", "r_p3p", "lc_vlp"})
    EXPECT_LT(error_m(panels, name), 1e-6) << name;
  const LadderProblem lame = exact_problem(room_of(LampShape::lame, 4), tilted_view(), 6);
  EXPECT_LT(error_m(lame, "lc_vlp"), 1e-6);
}

TEST(ShapeSteps, OneRectangleIsEnough) {
  for (const std::size_t lamps : {1, 2}) {
    const LadderProblem p = exact_problem(room_of(LampShape::rectangle), tilted_view(), lamps);
    for (const char* name : {"v_p4l", "corners", "lc_vlp"})
      EXPECT_LT(error_m(p, name), 1e-6) << name;
    for (const char* name : {"p3p", "solve_pose", "centres", "r_p3p", "paa"})
      EXPECT_FALSE(ladder_step_named(name).suits(p)) << name;
  }
  const LadderProblem disc = exact_problem(room_of(LampShape::disc), tilted_view(), 1);
  for (const LadderStep& step : ladder_steps()) EXPECT_FALSE(step.suits(disc)) << step.name;
}

TEST(ShapeSteps, ArcsSelectTheRightOneOfTwoDiscs) {
  Scene scene = room_of(LampShape::disc);
  scene.lamps[1].normal = Eigen::Vector3d(0.3, 0.1, -1).normalized();
  scene.lamps[2].normal = Eigen::Vector3d(-0.2, 0.4, -1).normalized();
  for (const std::size_t lamps : {2, 3, 6})
    EXPECT_LT(error_m(exact_problem(scene, tilted_view(), lamps), "paa"), 1e-6) << lamps;
}

// On one panel of 0.6 m from 2.5 m, the rungs attain their bound, and the peers do not.
TEST(ShapeSteps, OfOnePanelTheRungsAreAtTheirBound) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  Lamp panel;
  panel.shape = LampShape::rectangle;
  panel.centre_m = {2, 2, 3};
  panel.size_m = {0.6, 0.6};
  panel.x_axis = Eigen::Vector3d::UnitX();
  panel.power_w = 20;
  scene.lamps = {panel};
  scene.validate();
  constexpr int frames = 60;
  const std::vector<const char*> names = {"v_p4l", "corners", "lc_vlp", "rims", "direct"};
  std::map<std::string, double> squares;
  double pixels2 = 0;
  for (std::uint32_t i = 0; i < frames; ++i) {
    SimulateOptions options;
    options.frame = i;
    const double turn = 0.1 * i;
    const Rigid3 pose =
        look_at({2.3 + 0.01 * i, 1.6, 0.5}, {2.1, 1.9, 3.0}, {std::cos(turn), std::sin(turn), 0});
    const Rendered rendered = simulate(scene, pose, options);
    const LadderProblem p = ladder_problem(rendered.image.view(), scene, pose);
    ASSERT_EQ(p.corners_px.cols(), 4);
    for (const char* name : names) {
      const LadderOutcome outcome = run_step(p, ladder_step_named(name), 1e-9);
      ASSERT_TRUE(outcome.answered) << name;
      squares[name] += square(outcome.position_error_m / outcome.bound.position_m) / frames;
    }
    pixels2 +=
        square(ladder_bound(p, Rung::direct).position_m / ladder_bound(p, Rung::rims).position_m) /
        frames;
  }
  EXPECT_LT(pixels2, 1);
  EXPECT_LT(std::sqrt(squares["rims"]), 1.2);
  EXPECT_LT(std::sqrt(squares["direct"]), 1.2);
  for (const char* name : {"v_p4l", "corners", "lc_vlp"}) {
    EXPECT_GT(squares[name], squares["rims"]) << name;
    EXPECT_LT(squares[name], 400 * squares["rims"]) << name;
  }
}

}  // namespace
}  // namespace occ
