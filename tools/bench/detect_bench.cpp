// SPDX-License-Identifier: Apache-2.0
// Detection against OpenCV on the same frames, one thread: 1280 x 960 with 20 point lamps, and six
// discs of 15 px radius.
#include <benchmark/benchmark.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "libocc/core/random.hpp"
#include "libocc/detect/detect.hpp"

namespace {

constexpr int width = 1280, height = 960;
constexpr double gain_dn_per_e = 0.025, read_dn = 0.25, black_dn = 2, psf_px = 0.85;

/// Adds shot and read noise; pixels outside the lamps share one short random tile.
cv::Mat frame(const std::vector<cv::Point2d>& centres, double radius_px, double level_dn) {
  occ::Random random(1);
  cv::Mat image(height, width, CV_8U);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      double signal = 0;
      for (const cv::Point2d& centre : centres) {
        const double d = std::hypot(x - centre.x, y - centre.y);
        if (d > radius_px + 8) continue;
        signal += radius_px > 0 ? level_dn * 0.5 * std::erfc((d - radius_px) / (psf_px * M_SQRT2))
                                : level_dn * std::exp(-0.5 * d * d / (psf_px * psf_px));
      }
      const double sigma = std::sqrt(read_dn * read_dn + gain_dn_per_e * signal);
      image.at<std::uint8_t>(y, x) =
          cv::saturate_cast<std::uint8_t>(black_dn + signal + sigma * random.normal());
    }
  }
  return image;
}

cv::Mat spots() {
  occ::Random random(2);
  std::vector<cv::Point2d> centres;
  for (int i = 0; i < 20; ++i)
    centres.emplace_back(200 * (i % 5) + random.uniform(100, 300),
                         200 * (i / 5) + random.uniform(100, 300));
  return frame(centres, 0, 180);
}

cv::Mat discs() {
  std::vector<cv::Point2d> centres;
  for (int i = 0; i < 6; ++i)
    centres.emplace_back(250.3 + 300.7 * (i % 3), 300.1 + 350.9 * (i / 3));
  return frame(centres, 15, 170);
}

occ::ImageView view(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, 1, occ::PixelType::u8, image.step};
}

void run(benchmark::State& state, const cv::Mat& image, bool rims, std::size_t expected) {
  occ::DetectOptions options;
  options.rims = rims;
  for (auto _ : state) {
    const auto blobs = occ::detect(view(image), options);
    if (blobs.size() != expected) state.SkipWithError("wrong number of blobs");
  }
}

void spots_libocc(benchmark::State& state) { run(state, spots(), true, 20); }
void spots_libocc_no_rims(benchmark::State& state) { run(state, spots(), false, 20); }
void discs_libocc(benchmark::State& state) { run(state, discs(), true, 6); }
void discs_libocc_no_rims(benchmark::State& state) { run(state, discs(), false, 6); }

/// Threshold given to OpenCV, at no cost; libocc determines its own.
constexpr double threshold_dn = 5;

void contours_and_moments(benchmark::State& state, const cv::Mat& image, std::size_t expected) {
  cv::setNumThreads(1);
  cv::Mat bright;
  std::vector<std::vector<cv::Point>> contours;
  for (auto _ : state) {
    cv::threshold(image, bright, threshold_dn, 255, cv::THRESH_BINARY);
    cv::findContours(bright, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    std::size_t found = 0;
    for (const auto& contour : contours) {
      if (contour.size() < 4) continue;
      cv::Moments moments = cv::moments(image(cv::boundingRect(contour)));
      benchmark::DoNotOptimize(moments);
      ++found;
    }
    if (found != expected) state.SkipWithError("wrong number of contours");
  }
}

void spots_opencv_contours(benchmark::State& state) { contours_and_moments(state, spots(), 20); }
void discs_opencv_contours(benchmark::State& state) { contours_and_moments(state, discs(), 6); }

void spots_opencv_components(benchmark::State& state) {
  cv::setNumThreads(1);
  const cv::Mat image = spots();
  cv::Mat bright, labels, stats, centroids;
  for (auto _ : state) {
    cv::threshold(image, bright, threshold_dn, 255, cv::THRESH_BINARY);
    benchmark::DoNotOptimize(cv::connectedComponentsWithStats(bright, labels, stats, centroids));
  }
}

BENCHMARK(spots_libocc)->Unit(benchmark::kMicrosecond);
BENCHMARK(spots_libocc_no_rims)->Unit(benchmark::kMicrosecond);
BENCHMARK(spots_opencv_contours)->Unit(benchmark::kMicrosecond);
BENCHMARK(spots_opencv_components)->Unit(benchmark::kMicrosecond);
BENCHMARK(discs_libocc)->Unit(benchmark::kMicrosecond);
BENCHMARK(discs_libocc_no_rims)->Unit(benchmark::kMicrosecond);
BENCHMARK(discs_opencv_contours)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
