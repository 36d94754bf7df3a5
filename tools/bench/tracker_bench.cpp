// SPDX-License-Identifier: Apache-2.0
// Image to fused pose for each frame of a stream of 1280 x 960 with six lamps, one thread: the
// tracker by rims, by centroids, and without windows. The peer is a program of OpenCV functions
// with the assignment of the last frame: threshold, contours, moments, solvePnP from the last pose,
// no fusion. Median and 99th percentile are over frames.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "libocc/geometry/so3.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"

namespace {

using namespace occ;

constexpr double focal_px = 845, frame_s = 1.0 / 60;

Scene room() {
  Scene scene;
  scene.camera = Camera::pinhole(1280, 960, focal_px, focal_px, 639.5, 479.5);
  const double places[6][3] = {{1.3, 1.4, 3}, {2.6, 1.3, 3},   {1.4, 2.6, 3},
                               {2.6, 2.5, 3}, {2.05, 1.85, 3}, {1.6, 2.1, 2.6}};
  for (const auto& place : places) {
    Lamp lamp;
    lamp.id = static_cast<int>(scene.lamps.size());
    lamp.centre_m = {place[0], place[1], place[2]};
    lamp.radius_m = 0.085;
    lamp.power_w = 1.5;
    scene.lamps.push_back(lamp);
  }
  return scene;
}

struct Frame {
  Image image;
  double time_s;
};

Rigid3 pose_at(double time_s) {
  const Rigid3 camera = look_at({0, 0, 0.3}, {0, 0, 1}, {0, 1, 0});
  const double x = 2.0 + 0.2 * std::sin(time_s), y = 1.9 + 0.1 * std::sin(2 * time_s);
  return camera * body_from_world({x, y, 0.2 * std::sin(time_s)});
}

/// Closed path of ten seconds.
const std::vector<Frame>& stream() {
  static const std::vector<Frame> frames = [] {
    std::vector<Frame> out;
    Renderer renderer(room());
    Rendered rendered;
    for (int i = 0; i < 377; ++i) {
      SimulateOptions options;
      options.frame = static_cast<std::uint32_t>(i);
      renderer.render(pose_at(i * frame_s), options, rendered);
      out.push_back({rendered.image, i * frame_s});
    }
    return out;
  }();
  return frames;
}

/// Times each frame separately.
class Times {
 public:
  template <typename Work>
  void measure(Work&& work) {
    const auto begun = std::chrono::steady_clock::now();
    work();
    seconds_.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  }

  void report(benchmark::State& state) {
    std::sort(seconds_.begin(), seconds_.end());
    const double median = seconds_[seconds_.size() / 2];
    const double p99 = seconds_[seconds_.size() * 99 / 100];
    double sum = 0;
    for (const double s : seconds_) sum += s;
    state.counters["frames_per_s"] = static_cast<double>(seconds_.size()) / sum;
    state.counters["median_us"] = 1e6 * median;
    state.counters["p99_us"] = 1e6 * p99;
    state.counters["p99_over_median"] = p99 / median;
  }

 private:
  std::vector<double> seconds_;
};

void track(benchmark::State& state, const TrackerOptions& options) {
  Times times;
  double sum = 0;
  std::size_t count = 0;
  for (auto _ : state) {
    Tracker tracker(room(), options);
    for (const Frame& frame : stream()) {
      TrackedFrame tracked;
      times.measure([&] { tracked = tracker.add_image(frame.image.view(), frame.time_s); });
      if (tracked.state != TrackerState::tracking) state.SkipWithError(tracked.reason.c_str());
      sum += (tracked.position_m - pose_at(frame.time_s).origin_in_source()).squaredNorm();
      ++count;
    }
  }
  times.report(state);
  state.counters["rmse_um"] = 1e6 * std::sqrt(sum / static_cast<double>(count));
}

void BM_TrackerByRims(benchmark::State& state) { track(state, {}); }
BENCHMARK(BM_TrackerByRims)->Unit(benchmark::kMillisecond);

void BM_TrackerByCentroids(benchmark::State& state) {
  TrackerOptions options;
  options.locate.refine.rung = Rung::centres;
  track(state, options);
}
BENCHMARK(BM_TrackerByCentroids)->Unit(benchmark::kMillisecond);

void BM_TrackerOfWholeImages(benchmark::State& state) {
  TrackerOptions options;
  options.windows = false;
  track(state, options);
}
BENCHMARK(BM_TrackerOfWholeImages)->Unit(benchmark::kMillisecond);

/// Returns the centres of regions brighter than half of full scale.
std::vector<cv::Point2f> bright_spots(const Image& image) {
  const cv::Mat pixels(image.height, image.width, CV_8U,
                       const_cast<std::uint8_t*>(image.u8.data()));
  cv::Mat bright;
  cv::threshold(pixels, bright, 20, 255, cv::THRESH_BINARY);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(bright, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<cv::Point2f> spots;
  for (const auto& contour : contours) {
    const cv::Moments moments = cv::moments(contour);
    if (moments.m00 > 20)
      spots.emplace_back(static_cast<float>(moments.m10 / moments.m00),
                         static_cast<float>(moments.m01 / moments.m00));
  }
  return spots;
}

void BM_OpenCvFromTheLastPose(benchmark::State& state) {
  cv::setNumThreads(1);
  const Scene scene = room();
  std::vector<cv::Point3d> lamps;
  for (const Lamp& lamp : scene.lamps)
    lamps.emplace_back(lamp.centre_m.x(), lamp.centre_m.y(), lamp.centre_m.z());
  const cv::Mat intrinsics =
      (cv::Mat_<double>(3, 3) << focal_px, 0, 639.5, 0, focal_px, 479.5, 0, 0, 1);
  Times times;
  double sum = 0;
  std::size_t count = 0;
  for (auto _ : state) {
    Rigid3 pose = pose_at(0);
    cv::Mat rotation, translation = (cv::Mat_<double>(3, 1) << pose.translation.x(),
                                     pose.translation.y(), pose.translation.z());
    const Eigen::Vector3d turn = so3_log(pose.rotation);
    rotation = (cv::Mat_<double>(3, 1) << turn.x(), turn.y(), turn.z());
    for (const Frame& frame : stream()) {
      times.measure([&] {
        const std::vector<cv::Point2f> spots = bright_spots(frame.image);
        std::vector<cv::Point2d> expected;
        cv::projectPoints(lamps, rotation, translation, intrinsics, {}, expected);
        std::vector<cv::Point2d> seen;
        for (const cv::Point2d& px : expected) {
          const auto nearest = std::min_element(
              spots.begin(), spots.end(), [&](const cv::Point2f& a, const cv::Point2f& b) {
                return cv::norm(cv::Point2d(a) - px) < cv::norm(cv::Point2d(b) - px);
              });
          seen.emplace_back(*nearest);
        }
        cv::solvePnP(lamps, seen, intrinsics, {}, rotation, translation, true);
      });
      cv::Mat matrix;
      cv::Rodrigues(rotation, matrix);
      const cv::Mat centre = -matrix.t() * translation;
      const Eigen::Vector3d position(centre.at<double>(0), centre.at<double>(1),
                                     centre.at<double>(2));
      sum += (position - pose_at(frame.time_s).origin_in_source()).squaredNorm();
      ++count;
    }
  }
  times.report(state);
  state.counters["rmse_um"] = 1e6 * std::sqrt(sum / static_cast<double>(count));
}
BENCHMARK(BM_OpenCvFromTheLastPose)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
