// SPDX-License-Identifier: Apache-2.0
// Refinement of a pose 1 cm and 0.5 degrees off by every rung, and of the same centroids by OpenCV.
#include <benchmark/benchmark.h>

#include <opencv2/calib3d.hpp>

#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/pixel_blobs.hpp"

namespace occ {
namespace {

struct Case {
  Scene scene;
  std::vector<Blob> blobs;
  std::vector<Match> matches;
  Rigid3 start;
};

Case make_case(Scene scene, int rim_points) {
  Random random(1);
  Case c;
  c.scene = std::move(scene);
  const Rigid3 truth = look_at({2.1, 1.9, 0.5}, {2.0, 2.0, 3.0}, Eigen::Vector3d::UnitY());
  const test::Measurement measurement{rim_points};
  c.blobs =
      test::noisy(test::exact_blobs(c.scene, truth, measurement), c.scene, measurement, random);
  c.matches = test::in_order(c.scene);
  Vector6 off;
  off << 0.005, -0.005, 0.005, 0.006, -0.006, 0.006;
  c.start = perturb(truth, off);
  return c;
}

void run(benchmark::State& state, const Case& c, const RefineOptions& options = {}) {
  for (auto _ : state) {
    const Result<Refined> refined = refine(c.start, c.matches, c.blobs, c.scene, options);
    benchmark::DoNotOptimize(refined);
    if (!refined.ok()) state.SkipWithError("not refined");
    state.counters["iterations"] = refined->iterations;
  }
}

void six_discs_by_rims(benchmark::State& state) {
  run(state, make_case(test::irregular_room(), 80));
}
BENCHMARK(six_discs_by_rims);

void six_discs_by_rims_distorted(benchmark::State& state) {
  Scene scene = test::irregular_room();
  scene.camera = Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5, {-0.2, 0.05, 0, 0});
  run(state, make_case(scene, 80));
}
BENCHMARK(six_discs_by_rims_distorted);

/// Six discs of `diameter_px` in a simulated frame.
void six_discs_in_a_frame(benchmark::State& state, Rung rung, double diameter_px) {
  Scene scene = test::irregular_room();
  const double zoom = diameter_px / 28.7;  // 28.7 px at f = 422.5 px
  const double f = 422.5 * zoom;
  const int width = static_cast<int>(640 * zoom), height = static_cast<int>(480 * zoom);
  scene.camera = Camera::pinhole(width, height, f, f, 0.5 * (width - 1), 0.5 * (height - 1));
  scene.sensor.pixel_pitch_m /= zoom;
  scene.sensor.exposure_s *= zoom * zoom;
  const Rigid3 truth = look_at({2.1, 1.9, 0.5}, {2.0, 2.0, 3.0}, Eigen::Vector3d::UnitY());
  const test::Frame frame = test::make_frame(scene, truth, 1);
  Vector6 off;
  off << 0.005, -0.005, 0.005, 0.006, -0.006, 0.006;
  const Rigid3 start = perturb(truth, off);
  RefineOptions options;
  options.rung = rung;
  for (auto _ : state) {
    const Result<Refined> refined =
        refine(start, frame.matches, frame.blobs, scene, options, frame.image.view());
    benchmark::DoNotOptimize(refined);
    if (!refined.ok() || refined->lamps.back().rung != rung) state.SkipWithError("not refined");
    state.counters["iterations"] = refined->iterations;
    state.counters["lamps"] = static_cast<double>(frame.matches.size());
  }
}
BENCHMARK_CAPTURE(six_discs_in_a_frame, points_30_px, Rung::points, 30);
BENCHMARK_CAPTURE(six_discs_in_a_frame, centres_30_px, Rung::centres, 30);
BENCHMARK_CAPTURE(six_discs_in_a_frame, rims_30_px, Rung::rims, 30);
BENCHMARK_CAPTURE(six_discs_in_a_frame, direct_20_px, Rung::direct, 20);
BENCHMARK_CAPTURE(six_discs_in_a_frame, direct_30_px, Rung::direct, 30);
BENCHMARK_CAPTURE(six_discs_in_a_frame, direct_45_px, Rung::direct, 45);
BENCHMARK_CAPTURE(six_discs_in_a_frame, direct_60_px, Rung::direct, 60);

void four_discs_by_centroids(benchmark::State& state) {
  run(state, make_case(test::square_room(), 0));
}
BENCHMARK(four_discs_by_centroids);

void four_discs_by_points(benchmark::State& state) {
  RefineOptions options;
  options.rung = Rung::points;
  run(state, make_case(test::square_room(), 0), options);
}
BENCHMARK(four_discs_by_points);

void opencv_four_points(benchmark::State& state) {
  const Case c = make_case(test::square_room(), 0);
  std::vector<cv::Point3d> world;
  std::vector<cv::Point2d> image;
  for (std::size_t i = 0; i < c.blobs.size(); ++i) {
    const Eigen::Vector3d& p = c.scene.lamps[i].centre_m;
    world.emplace_back(p.x(), p.y(), p.z());
    image.emplace_back(c.blobs[i].centroid_px.x(), c.blobs[i].centroid_px.y());
  }
  const Eigen::Vector3d w = so3_log(c.start.rotation);
  const Eigen::Vector3d& t = c.start.translation;
  const cv::Matx33d k(422.5, 0, 319.5, 0, 422.5, 239.5, 0, 0, 1);
  for (auto _ : state) {
    cv::Mat rotation = (cv::Mat_<double>(3, 1) << w.x(), w.y(), w.z());
    cv::Mat translation = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
    cv::solvePnPRefineLM(world, image, k, cv::noArray(), rotation, translation);
    benchmark::DoNotOptimize(translation.data);
  }
}
BENCHMARK(opencv_four_points);

}  // namespace
}  // namespace occ

BENCHMARK_MAIN();
