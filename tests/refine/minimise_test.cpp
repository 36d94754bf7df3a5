// SPDX-License-Identifier: Apache-2.0
// The minimiser of the refinement, and the other poses that fit the same centroids.
#include "libocc/refine/internal/minimise.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/pose/solvers/p3p.hpp"
#include "libocc/refine/internal/newton.hpp"
#include "libocc/refine/internal/pose_roots.hpp"
#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ {
using namespace internal::refine;
namespace {

struct NoisyRoom {
  Scene scene = test::irregular_room();
  Rigid3 truth = look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0});
  std::vector<Blob> blobs;
  RefineOptions options;
  Observations observations;

  explicit NoisyRoom(std::uint64_t seed, Rung rung) {
    Random random(8, seed);
    test::Measurement m{24, 0.05, 0.03, 0, 0, 0.02};
    blobs = test::noisy(test::exact_blobs(scene, truth, m), scene, m, random);
    options.rung = rung;
    observations = observe(test::in_order(scene), blobs, scene, options);
  }
};

/// The true pose with an error of each unknown.
Rigid3 near_truth(const NoisyRoom& room, double sigma, Random& random) {
  Vector6 off;
  for (double& value : off) value = sigma * random.normal();
  return perturb(room.truth, off);
}

/// True if no small move of the pose lowers chi2.
bool is_minimum(RefineProblem& problem, const State& state) {
  const Eigen::Vector3d pivot = problem.pivot(state);
  PoseNormalEquations normal;
  if (!problem.linearise(state, pivot, normal)) return false;
  const double chi2 = problem.chi2(state);
  for (int i = 0; i < 6; ++i)
    for (const double side : {-1, 1}) {
      const double sigma = 1 / std::sqrt(normal.information(i, i));
      const Vector8 step = 0.05 * side * sigma * Vector8::Unit(i);
      if (problem.chi2(moved(state, pivot, step)) < chi2) return false;
    }
  return true;
}

TEST(Minimise, EndsAtTheMinimumOfChi2) {
  for (const Rung rung : {Rung::centres, Rung::rims}) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
      const NoisyRoom room(seed, rung);
      RefineProblem problem(room.observations, room.scene, room.options, rung);
      Random random(9, seed);
      const Rigid3 near = near_truth(room, 0.02, random);
      const State start{near};
      EXPECT_FALSE(is_minimum(problem, start));
      const Minimum found = minimise(problem, start, 30, 1e-5);
      EXPECT_TRUE(found.defined);
      EXPECT_TRUE(found.converged);
      EXPECT_GT(found.iterations, 1);
      EXPECT_LT(found.iterations, 20);
      EXPECT_TRUE(is_minimum(problem, found.state)) << seed;
      const Minimum polished = polish(problem, {room.truth}, 30, 1e-5);
      EXPECT_TRUE(polished.converged);
      EXPECT_LT(difference(polished.state.cam_from_world, found.state.cam_from_world).norm(), 1e-6);
    }
  }
}

TEST(Minimise, ReportsThatItStoppedEarly) {
  const NoisyRoom room(1, Rung::centres);
  RefineProblem problem(room.observations, room.scene, room.options, Rung::centres);
  const State start{perturb(room.truth, Vector6::Constant(0.05))};
  EXPECT_FALSE(minimise(problem, start, 1, 1e-9).converged);
  EXPECT_FALSE(polish(problem, start, 1, 1e-9).converged);
  EXPECT_EQ(polish(problem, start, 2, 1e-9).iterations, 2);
  // A coarse tolerance is met sooner.
  EXPECT_LE(polish(problem, start, 30, 1).iterations, polish(problem, start, 30, 1e-5).iterations);
}

TEST(Minimise, IsUndefinedWhereALampIsBehindTheCamera) {
  const NoisyRoom room(1, Rung::centres);
  RefineProblem problem(room.observations, room.scene, room.options, Rung::centres);
  const State behind{look_at({2.1, 1.8, 0.5}, {2.3, 2.1, -3.0}, {0.2, 1, 0})};
  EXPECT_FALSE(minimise(problem, behind, 30, 1e-5).defined);
  EXPECT_FALSE(polish(problem, behind, 30, 1e-5).defined);
}

/// Minimum record of a state before any step.
Minimum at_start(RefineProblem& problem, const State& state) {
  Minimum minimum;
  minimum.state = state;
  minimum.pivot = problem.pivot(state);
  minimum.defined = problem.linearise(state, minimum.pivot, minimum.normal);
  return minimum;
}

/// Half the matrix of second differences of the robust chi2 at the minimum, in its units.
Matrix8 half_second_differences(RefineProblem& problem, const Minimum& minimum,
                                const Vector8& units) {
  const auto chi2 = [&](int i, double a, int k, double b) {
    const Vector8 step = a * units[i] * Vector8::Unit(i) + b * units[k] * Vector8::Unit(k);
    const State state = moved(minimum.state, minimum.pivot, step);
    PoseNormalEquations normal;
    problem.linearise(state, problem.pivot(state), normal);
    return normal.robust_chi2;
  };
  constexpr double h = 0.02;
  Matrix8 half;
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 8; ++k)
      half(i, k) = (chi2(i, h, k, h) - chi2(i, h, k, -h) - chi2(i, -h, k, h) + chi2(i, -h, k, -h)) /
                   (8 * h * h);
  return half;
}

TEST(Newton, EndsAtTheMinimumWithItsCurvature) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const NoisyRoom room(seed, Rung::centres);
    RefineProblem problem(room.observations, room.scene, room.options, Rung::centres);
    Random random(10, seed);
    const Rigid3 near = near_truth(room, 0.02, random);
    const State start{near};
    const Minimum expected = minimise(problem, start, 30, 1e-6);
    Minimum found = at_start(problem, start);
    run_newton(problem, 30, 1e-6, found);
    ASSERT_TRUE(found.converged);
    EXPECT_GT(found.iterations, 1);
    EXPECT_LT(found.iterations, 10);
    EXPECT_TRUE(is_minimum(problem, found.state));
    EXPECT_LT(difference(found.state.cam_from_world, expected.state.cam_from_world).norm(), 1e-6);
    const Vector8 units = units_of(at_start(problem, found.state).normal);
    const Matrix8 scaled = units.asDiagonal() * found.normal.information * units.asDiagonal();
    const Matrix8 half = half_second_differences(problem, found, units);
    const Matrix6 off_by = (scaled - half).topLeftCorner<6, 6>();
    EXPECT_LT(off_by.cwiseAbs().maxCoeff(), 2e-3) << scaled << half;
  }
}

TEST(Newton, NeverClimbsAndReportsAnEarlyEnd) {
  int converged = 0, shortened = 0;
  for (std::uint64_t seed = 0; seed < 12; ++seed) {
    const NoisyRoom room(seed, Rung::centres);
    RefineProblem problem(room.observations, room.scene, room.options, Rung::centres);
    Random random(11, seed);
    const Rigid3 near = near_truth(room, 0.25, random);
    Minimum found = at_start(problem, {near});
    if (!found.defined) continue;
    double chi2 = found.normal.robust_chi2;
    for (int step = 0; step < 40 && !found.converged; ++step) {
      const int before = found.iterations;
      run_newton(problem, 1, 1e-6, found);
      if (found.converged) break;
      EXPECT_LE(found.normal.robust_chi2, chi2 * (1 + 1e-9)) << seed;
      if (found.iterations == before) break;
      EXPECT_EQ(found.iterations, before + 1);
      shortened += found.normal.robust_chi2 > 0.5 * chi2;
      chi2 = found.normal.robust_chi2;
    }
    converged += found.converged;
    EXPECT_TRUE(!found.converged || is_minimum(problem, found.state)) << seed;
  }
  EXPECT_GE(converged, 6);
  EXPECT_GE(shortened, 3);
}

TEST(Newton, StopsWhereALampTurnsItsDarkSide) {
  // A lamp seen exactly from the side: the camera sees its lit side here, but not a step farther.
  NoisyRoom room(1, Rung::centres);
  Lamp& lamp = room.scene.lamps[0];
  const Eigen::Vector3d view = (room.truth.origin_in_source() - lamp.centre_m).normalized();
  lamp.normal = (view.unitOrthogonal() + 1e-9 * view).normalized();
  RefineProblem problem(room.observations, room.scene, room.options, Rung::centres);
  Minimum minimum = at_start(problem, {room.truth});
  ASSERT_TRUE(minimum.defined);
  run_newton(problem, 30, 1e-6, minimum);
  EXPECT_FALSE(minimum.converged);
  EXPECT_EQ(minimum.iterations, 0);
  EXPECT_EQ(minimum.state.cam_from_world.translation, room.truth.translation);
}

/// Three lamps that several poses fit, and a fourth lamp.
struct Ambiguous {
  Scene scene;
  Rigid3 truth;
  std::vector<Blob> blobs;
  std::vector<Rigid3> poses;  // that fit the first three

  Ambiguous() {
    scene.camera = test::vga_camera();
    for (const double angle : {0.2, 1.6, 3.1}) {
      Lamp lamp = test::disc_lamp(static_cast<int>(scene.lamps.size()),
                                  {0.8 * std::cos(angle), 0.8 * std::sin(angle), 2.5}, 0.003);
      scene.lamps.push_back(lamp);
    }
    scene.lamps.push_back(test::disc_lamp(3, {-0.5, -0.7, 2.2}, 0.003));
    const Eigen::Vector3d position(0.1, 0.62, 0);
    truth = {so3_exp({0.05, -0.04, 0}), Eigen::Vector3d::Zero()};
    truth.translation = -(truth.rotation * position);
    test::Measurement m;
    m.centroid_sigma_px = 0.03;
    blobs = test::exact_blobs(scene, truth, m);
    Eigen::Matrix3d bearings, points;
    for (int i = 0; i < 3; ++i) {
      bearings.col(i) = scene.camera.unproject(blobs[i].centroid_px).value();
      points.col(i) = scene.lamps[i].centre_m;
    }
    for (const Rigid3& pose : p3p(bearings, points)) poses.push_back(pose);
  }

  std::vector<Rigid3> others(int lamps, bool last_contradicts = false) const {
    std::vector<Match> matches;
    for (int i = 0; i < lamps; ++i) matches.push_back({i, i});
    RefineOptions options;
    options.rung = Rung::centres;
    const auto refined =
        refine(truth, {matches.begin(), matches.begin() + 3}, blobs, scene, options);
    Refined all = *refined;
    for (int i = 3; i < lamps; ++i) {
      LampResidual residual;
      residual.match = {i, i};
      residual.contradicts = last_contradicts;
      all.lamps.push_back(residual);
    }
    return other_roots(all, blobs, scene);
  }
};

bool contains_pose(const std::vector<Rigid3>& poses, const Rigid3& pose) {
  return std::any_of(poses.begin(), poses.end(), [&](const Rigid3& other) {
    return (pose.origin_in_source() - other.origin_in_source()).norm() < 2e-3;
  });
}

TEST(OtherRoots, ThoseOfThreeLampsAreExcludedByAFourthThatIsWhole) {
  const Ambiguous view;
  ASSERT_GE(view.poses.size(), 2u);
  const std::vector<Rigid3> three = view.others(3);
  EXPECT_EQ(three.size() + 1, view.poses.size());
  EXPECT_FALSE(contains_pose(three, view.truth));
  for (const Rigid3& pose : view.poses)
    EXPECT_TRUE(contains_pose(three, pose) || contains_pose({view.truth}, pose));
  EXPECT_TRUE(view.others(4).empty());
}

TEST(OtherRoots, PartsOfLampsAndContradictingOnesExcludeNothing) {
  for (const bool cut : {true, false}) {
    Ambiguous view;
    (cut ? view.blobs[3].cut_by_border : view.blobs[3].merged) = true;
    view.blobs[3].centroid_px += Eigen::Vector2d(30, -20);  // that of the visible part
    EXPECT_EQ(view.others(4).size(), view.poses.size() - 1) << cut;
  }
  Ambiguous view;
  view.blobs[3].centroid_px += Eigen::Vector2d(30, -20);
  EXPECT_EQ(view.others(4, true).size(), view.poses.size() - 1);
}

}  // namespace
}  // namespace occ
