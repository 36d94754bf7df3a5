// SPDX-License-Identifier: Apache-2.0
// Image to pose, one thread, beside a program of OpenCV functions: threshold, contours, moments and
// solvePnP. The peer gets the true assignment of blobs to lamps; `locate` has to find it. Then the
// parts without detection: locate() from blobs, and the protection level that it prepares.
#include <benchmark/benchmark.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"

namespace {

using namespace occ;

Lamp disc(int id, double x_m, double y_m, double z_m) {
  Lamp lamp;
  lamp.id = id;
  lamp.centre_m = {x_m, y_m, z_m};
  lamp.radius_m = 0.085;
  lamp.power_w = 1.5;
  return lamp;
}

Scene room() {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 422.5, 422.5, 319.5, 239.5);
  scene.lamps = {disc(0, 1.3, 1.4, 3), disc(1, 2.6, 1.3, 3),   disc(2, 1.4, 2.6, 3),
                 disc(3, 2.6, 2.5, 3), disc(4, 2.05, 1.85, 3), disc(5, 1.6, 2.1, 2.6)};
  return scene;
}

/// Renders a frame that contains all six lamps wholly.
Rendered frame() {
  const Rigid3 pose = look_at({2.0, 1.9, 0.3}, {2.1, 1.95, 3}, Eigen::Vector3d::UnitY());
  return simulate(room(), pose);
}

void BM_Locate(benchmark::State& state) {
  const Scene scene = room();
  const Rendered rendered = frame();
  for (auto _ : state) {
    const Result<Fix> fix = locate(rendered.image.view(), scene);
    if (!fix.ok() || fix->lamps.size() != 6) state.SkipWithError(fix.message.c_str());
    benchmark::DoNotOptimize(fix);
  }
}
BENCHMARK(BM_Locate)->Unit(benchmark::kMicrosecond);

void BM_LocateBlobs(benchmark::State& state) {
  const Scene scene = room();
  const std::vector<Blob> seen = detect(frame().image.view(), {});
  for (auto _ : state) benchmark::DoNotOptimize(locate(seen, scene));
}
BENCHMARK(BM_LocateBlobs)->Unit(benchmark::kMicrosecond);

void BM_ProtectionLevel(benchmark::State& state) {
  const Result<Fix> fix = locate(frame().image.view(), room());
  if (!fix->protection_level_m().ok()) state.SkipWithError("no level");
  for (auto _ : state) benchmark::DoNotOptimize(fix->protection_level_m());
}
BENCHMARK(BM_ProtectionLevel)->Unit(benchmark::kMicrosecond);

void BM_OpenCvWithNamesGiven(benchmark::State& state) {
  cv::setNumThreads(1);
  const Scene scene = room();
  const Rendered rendered = frame();
  const cv::Mat image(rendered.image.height, rendered.image.width, CV_8U,
                      const_cast<std::uint8_t*>(rendered.image.u8.data()));
  const cv::Mat intrinsics = (cv::Mat_<double>(3, 3) << 422.5, 0, 319.5, 0, 422.5, 239.5, 0, 0, 1);
  for (auto _ : state) {
    cv::Mat bright, rotation, translation;
    cv::threshold(image, bright, 20, 255, cv::THRESH_BINARY);
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(bright, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    std::vector<cv::Point2d> seen;
    std::vector<cv::Point3d> known;
    for (const auto& contour : contours) {
      const cv::Moments m = cv::moments(contour);
      const cv::Point2d centre(m.m10 / m.m00, m.m01 / m.m00);
      for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
        const Eigen::Vector2d truth = rendered.lamps[i].image_centre_px;
        if (cv::norm(centre - cv::Point2d(truth.x(), truth.y())) > 3) continue;
        const Eigen::Vector3d& c = scene.lamps[i].centre_m;
        seen.push_back(centre);
        known.emplace_back(c.x(), c.y(), c.z());
      }
    }
    cv::solvePnP(known, seen, intrinsics, cv::noArray(), rotation, translation, false,
                 cv::SOLVEPNP_SQPNP);
    cv::solvePnPRefineLM(known, seen, intrinsics, cv::noArray(), rotation, translation);
    benchmark::DoNotOptimize(translation);
  }
}
BENCHMARK(BM_OpenCvWithNamesGiven)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
