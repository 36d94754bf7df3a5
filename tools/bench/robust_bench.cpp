// SPDX-License-Identifier: Apache-2.0
// robust_pose, one thread: 200 points of which some were matched wrongly, in per cent, without and
// with known gravity; and OpenCV's solvePnPRansac (USAC, MAGSAC) beside it. tools/robust_peers
// compares success and accuracy.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <opencv2/calib3d.hpp>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/random.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/locate/robust_pose.hpp"

namespace {

using namespace occ;

constexpr int points = 200;
constexpr double sigma_px = 0.5, gate_sigmas = 4;

struct Matched {
  Eigen::Matrix3Xd points;
  Eigen::Matrix2Xd pixels;
  Rigid3 truth;
};

Camera vga() { return Camera::pinhole(640, 480, 800, 800, 319.5, 239.5); }

std::vector<Matched> problems(int percent_wrong) {
  std::vector<Matched> all(50);
  Random random(3, static_cast<std::uint64_t>(percent_wrong));
  const auto anywhere = [&] {
    return Eigen::Vector2d(random.uniform(0, 640), random.uniform(0, 480));
  };
  for (Matched& m : all) {
    m.truth.rotation = so3_exp(Eigen::Vector3d(random.normal(), random.normal(), random.normal()));
    m.points.resize(3, points);
    m.pixels.resize(2, points);
    for (int i = 0; i < points; ++i) {
      const Eigen::Vector2d pixel = anywhere();
      m.points.col(i) = m.truth.inverse() * (random.uniform(2, 8) * *vga().unproject(pixel));
      m.pixels.col(i) = pixel + sigma_px * Eigen::Vector2d(random.normal(), random.normal());
      if (100 * i < percent_wrong * points) m.pixels.col(i) = anywhere();
    }
  }
  return all;
}

void robust_pose_own(benchmark::State& state) {
  const std::vector<Matched> all = problems(static_cast<int>(state.range(0)));
  const Camera camera = vga();
  RobustPoseOptions options;
  options.sigma_px = sigma_px;
  options.gate_sigmas = gate_sigmas;
  std::size_t i = 0;
  for (auto _ : state) {
    const Matched& m = all[i++ % all.size()];
    if (state.range(1) == 1) options.up_in_cam = m.truth.rotation.col(2);
    benchmark::DoNotOptimize(robust_pose(m.points, m.pixels, camera, options));
  }
}
BENCHMARK(robust_pose_own)
    ->ArgNames({"wrong_percent", "gravity"})
    ->ArgsProduct({{30, 50, 70, 85}, {0, 1}})
    ->Unit(benchmark::kMicrosecond);

void robust_pose_opencv(benchmark::State& state) {
  const std::vector<Matched> all = problems(static_cast<int>(state.range(0)));
  const cv::Matx33d k(800, 0, 319.5, 0, 800, 239.5, 0, 0, 1);
  std::size_t at = 0;
  for (auto _ : state) {
    state.PauseTiming();
    const Matched& m = all[at++ % all.size()];
    std::vector<cv::Point3d> world;
    std::vector<cv::Point2d> seen;
    for (int i = 0; i < points; ++i) {
      world.emplace_back(m.points(0, i), m.points(1, i), m.points(2, i));
      seen.emplace_back(m.pixels(0, i), m.pixels(1, i));
    }
    cv::UsacParams usac;
    usac.confidence = 0.9999;
    usac.maxIterations = 100000;
    usac.threshold = gate_sigmas * sigma_px;
    usac.loMethod = cv::LOCAL_OPTIM_INNER_LO;
    usac.score = cv::SCORE_METHOD_MAGSAC;
    cv::Mat matrix = cv::Mat(k), rotation, translation, inliers;
    state.ResumeTiming();
    benchmark::DoNotOptimize(
        cv::solvePnPRansac(world, seen, matrix, {}, rotation, translation, inliers, usac));
  }
}
BENCHMARK(robust_pose_opencv)
    ->ArgName("wrong_percent")
    ->Arg(30)
    ->Arg(50)
    ->Arg(70)
    ->Arg(85)
    ->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
