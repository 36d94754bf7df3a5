// SPDX-License-Identifier: Apache-2.0
// Pose solvers against OpenGV and OpenCV, one thread: three points to all poses, bare and guarded;
// image points to a pose with its covariance; the refinement of four points against one by hand.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <array>
#include <opencv2/calib3d.hpp>
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/locate/solve_pose.hpp"
#include "libocc/pose/candidates.hpp"
#include "libocc/pose/solvers/p3p.hpp"
#include "tools/bench/points_levenberg_marquardt.hpp"

namespace {

using namespace occ;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct ThreePoints {
  Matrix3d bearings, points;
};

/// Random problems with all points in front of the camera.
std::vector<ThreePoints> random_problems(int count) {
  Random random(2);
  std::vector<ThreePoints> problems;
  while (static_cast<int>(problems.size()) < count) {
    ThreePoints p;
    for (int i = 0; i < 9; ++i) p.points(i % 3, i / 3) = random.normal();
    const Matrix3d rotation =
        so3_exp(3 * Vector3d(random.normal(), random.normal(), random.normal()));
    const Matrix3d in_cam =
        (rotation * p.points).colwise() + Vector3d(random.normal(), random.normal(), 4);
    p.bearings = in_cam.colwise().normalized();
    if (in_cam.row(2).minCoeff() > 0.1) problems.push_back(p);
  }
  return problems;
}

/// Times the solver with a result vector that is reused, as in a loop.
void p3p_own(benchmark::State& state) {
  const std::vector<ThreePoints> problems = random_problems(1000);
  std::vector<Rigid3> poses;
  std::size_t i = 0;
  for (auto _ : state) {
    const ThreePoints& p = problems[i++ % problems.size()];
    benchmark::DoNotOptimize(p3p(p.bearings, p.points, poses));
  }
}
BENCHMARK(p3p_own);

void p3p_own_checked(benchmark::State& state) {
  const std::vector<ThreePoints> problems = random_problems(1000);
  std::size_t i = 0;
  for (auto _ : state) {
    const ThreePoints& p = problems[i++ % problems.size()];
    benchmark::DoNotOptimize(p3p(p.bearings, p.points));
  }
}
BENCHMARK(p3p_own_checked);

/// Times P3P without check and polishing, as the identification calls it.
void p3p_own_within(benchmark::State& state) {
  const std::vector<ThreePoints> problems = random_problems(1000);
  std::array<Rigid3, 4> poses;
  std::size_t i = 0;
  for (auto _ : state) {
    const ThreePoints& p = problems[i++ % problems.size()];
    benchmark::DoNotOptimize(p3p_within(p.bearings, p.points, 0.01, poses));
  }
}
BENCHMARK(p3p_own_within);

void p3p_guarded(benchmark::State& state, const char* solver) {
  std::vector<PoseProblem> problems;
  for (const ThreePoints& p : random_problems(1000))
    problems.push_back({p.bearings, p.points, {}, {}});
  std::size_t i = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(pose_candidates(problems[i++ % problems.size()], solver));
}
BENCHMARK_CAPTURE(p3p_guarded, own, "p3p");
BENCHMARK_CAPTURE(p3p_guarded, kneip, "p3p_kneip");
BENCHMARK_CAPTURE(p3p_guarded, gao, "p3p_gao");

void p3p_opengv_kneip(benchmark::State& state) {
  std::vector<opengv::bearingVectors_t> bearings;
  std::vector<opengv::points_t> points;
  for (const ThreePoints& p : random_problems(1000)) {
    bearings.emplace_back();
    points.emplace_back();
    for (int k = 0; k < 3; ++k) {
      bearings.back().push_back(p.bearings.col(k));
      points.back().push_back(p.points.col(k));
    }
  }
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t k = i++ % points.size();
    const opengv::absolute_pose::CentralAbsoluteAdapter adapter(bearings[k], points[k]);
    benchmark::DoNotOptimize(opengv::absolute_pose::p3p_kneip(adapter));
  }
}
BENCHMARK(p3p_opengv_kneip);

void p3p_opencv(benchmark::State& state, int method) {
  std::vector<std::vector<cv::Point3d>> points;
  std::vector<std::vector<cv::Point2d>> pixels;
  for (const ThreePoints& p : random_problems(1000)) {
    points.emplace_back();
    pixels.emplace_back();
    for (int k = 0; k < 3; ++k) {
      points.back().emplace_back(p.points(0, k), p.points(1, k), p.points(2, k));
      pixels.back().emplace_back(p.bearings(0, k) / p.bearings(2, k),
                                 p.bearings(1, k) / p.bearings(2, k));
    }
  }
  const cv::Mat identity = cv::Mat::eye(3, 3, CV_64F);
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t k = i++ % points.size();
    std::vector<cv::Mat> rotations, translations;
    cv::solveP3P(points[k], pixels[k], identity, cv::noArray(), rotations, translations, method);
    benchmark::DoNotOptimize(rotations);
  }
}
BENCHMARK_CAPTURE(p3p_opencv, p3p, cv::SOLVEPNP_P3P);
BENCHMARK_CAPTURE(p3p_opencv, ap3p, cv::SOLVEPNP_AP3P);

/// Views of n points within a metre, 3 to 8 m away, 0.5 px of noise.
struct Views {
  Camera camera = Camera::pinhole(1280, 960, 800, 800, 639.5, 479.5);
  std::vector<Eigen::Matrix3Xd> points;
  std::vector<Eigen::Matrix2Xd> pixels;
  std::vector<Rigid3> truth;

  Views(int n, bool flat) {
    Random random(5);
    while (points.size() < 400) {
      Eigen::Matrix3Xd p(3, n);
      for (int i = 0; i < n; ++i)
        p.col(i) << random.uniform(-1, 1), random.uniform(-1, 1), flat ? 0 : random.uniform(-1, 1);
      const Rigid3 pose{so3_exp(3 * Vector3d(random.normal(), random.normal(), random.normal())),
                        {random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(3, 8)}};
      constexpr double grazing = 0.3;
      if (flat && std::abs(pose.rotation(2, 2)) < grazing) continue;
      add(p, pose, random);
    }
  }

  void add(const Eigen::Matrix3Xd& p, const Rigid3& pose, Random& random) {
    Eigen::Matrix2Xd px(2, p.cols());
    for (Eigen::Index i = 0; i < p.cols(); ++i) {
      const auto seen = camera.project(pose * Vector3d(p.col(i)));
      if (!seen || !camera.contains(*seen)) return;
      px.col(i) = *seen + 0.5 * Vector2d(random.normal(), random.normal());
    }
    points.push_back(p);
    pixels.push_back(px);
    truth.push_back(pose);
  }
};

void points_to_pose(benchmark::State& state, int n, bool flat) {
  const Views views(n, flat);
  SolvePoseOptions options;
  options.sigma_px = 0.5;
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t k = i++ % views.points.size();
    benchmark::DoNotOptimize(solve_pose(views.points[k], views.pixels[k], views.camera, options));
  }
}

void points_to_pose_sqpnp(benchmark::State& state, int n, bool flat) {
  Views views(n, flat);
  const cv::Matx33d camera(800, 0, 639.5, 0, 800, 479.5, 0, 0, 1);
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t k = i++ % views.points.size();
    const cv::Mat points(n, 3, CV_64F, views.points[k].data());
    const cv::Mat pixels(n, 2, CV_64F, views.pixels[k].data());
    cv::Mat rotation, translation;
    cv::solvePnP(points, pixels, camera, cv::noArray(), rotation, translation, false,
                 cv::SOLVEPNP_SQPNP);
    benchmark::DoNotOptimize(translation.data);
  }
}

#define BOTH(name, n, flat)                         \
  BENCHMARK_CAPTURE(points_to_pose, name, n, flat); \
  BENCHMARK_CAPTURE(points_to_pose_sqpnp, name, n, flat)
BOTH(4_flat, 4, true);
BOTH(4, 4, false);
BOTH(6, 6, false);
BOTH(20, 20, false);
BOTH(100, 100, false);

/// Starts 0.3 degrees and 1 % of the distance off.
Rigid3 start_near(const Rigid3& truth) {
  Vector6 off;
  off << 0.005, -0.005, 0.005, 0.02, -0.02, 0.03;
  return perturb(truth, off);
}

void refine_four_points(benchmark::State& state) {
  const Views views(4, true);
  SolvePoseOptions options;
  options.sigma_px = 0.5;
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t k = i++ % views.points.size();
    options.start = start_near(views.truth[k]);
    benchmark::DoNotOptimize(solve_pose(views.points[k], views.pixels[k], views.camera, options));
  }
}
BENCHMARK(refine_four_points);

void refine_four_points_by_hand(benchmark::State& state) {
  const Views views(4, true);
  std::vector<std::vector<Vector3d>> world(views.points.size());
  std::vector<std::vector<Vector2d>> pixels(views.points.size());
  for (std::size_t k = 0; k < world.size(); ++k)
    for (int i = 0; i < 4; ++i) {
      world[k].push_back(views.points[k].col(i));
      pixels[k].push_back(views.pixels[k].col(i));
    }
  std::size_t i = 0;
  for (auto _ : state) {
    const std::size_t k = i++ % world.size();
    const bench::PinholePoints problem{800, 800, 639.5, 479.5, world[k], pixels[k]};
    benchmark::DoNotOptimize(bench::levenberg_marquardt(problem, start_near(views.truth[k]), 30));
  }
}
BENCHMARK(refine_four_points_by_hand);

}  // namespace

BENCHMARK_MAIN();
