// SPDX-License-Identifier: Apache-2.0
// Detection without its sub-pixel accuracy (accuracy_test.cpp): components, thresholds, flags,
// image types, invalid input.
#include "libocc/detect/detect.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "libocc/simulate/simulate.hpp"
#include "tests/detect/detect_support.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::Canvas;
using test::complaint;

using Box = std::array<int, 5>;  // x0, y0, x1, y1, pixels

DetectOptions everything_above(double level_dn) {
  DetectOptions options;
  options.threshold_dn = level_dn;
  options.min_area_px = 1;
  options.max_blobs = 1 << 20;
  options.rims = false;
  return options;
}

std::vector<Box> boxes(const std::vector<Blob>& blobs) {
  std::vector<Box> out;
  for (const Blob& b : blobs) out.push_back({b.x0, b.y0, b.x1, b.y1, b.area_px});
  std::sort(out.begin(), out.end());
  return out;
}

/// Reference: connected bright pixels by flood fill.
std::vector<Box> flooded(const Image& image, int level_dn) {
  std::vector<char> todo(image.u8.size());
  for (std::size_t i = 0; i < todo.size(); ++i) todo[i] = image.u8[i] > level_dn;
  std::vector<Box> out;
  for (int start = 0; start < static_cast<int>(todo.size()); ++start) {
    if (!todo[start]) continue;
    Box box{image.width, image.height, -1, -1, 0};
    std::vector<int> stack{start};
    todo[start] = 0;
    while (!stack.empty()) {
      const int at = stack.back(), x = at % image.width, y = at / image.width;
      stack.pop_back();
      box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y),
             box[4] + 1};
      for (int ny = std::max(0, y - 1); ny <= std::min(image.height - 1, y + 1); ++ny) {
        for (int nx = std::max(0, x - 1); nx <= std::min(image.width - 1, x + 1); ++nx) {
          char& bright = todo[ny * image.width + nx];
          if (std::exchange(bright, 0)) stack.push_back(ny * image.width + nx);
        }
      }
    }
    out.push_back(box);
  }
  std::sort(out.begin(), out.end());
  return out;
}

Image random_image(Random& random, int width, int height, double bright_share) {
  Image image;
  image.width = width;
  image.height = height;
  for (int i = 0; i < width * height; ++i)
    image.u8.push_back(random.uniform(0, 1) < bright_share ? 200 : 0);
  return image;
}

// Widths near the 64 pixels and heights near the 64 rows that share a threshold.
TEST(Detect, ComponentsAreThoseOfAFloodFill) {
  Random random(1);
  for (const double share : {0.001, 0.02, 0.2, 0.45, 0.7, 1.0}) {
    for (const auto& [width, height] :
         {std::pair{1, 1}, {1, 130}, {130, 1}, {63, 65}, {64, 64}, {65, 63}, {200, 131}}) {
      const Image image = random_image(random, width, height, share);
      EXPECT_EQ(boxes(detect(image.view(), everything_above(100))), flooded(image, 100))
          << width << " x " << height << ", " << share;
    }
  }
}

TEST(Detect, RowPaddingDoesNotChangeTheResult) {
  Random random(2);
  const Image image = random_image(random, 190, 140, 0.01);
  constexpr std::size_t stride = 211;
  std::vector<std::uint8_t> padded(stride * 140, 255);
  for (std::size_t y = 0; y < 140; ++y)
    std::copy_n(image.u8.begin() + static_cast<std::ptrdiff_t>(y * 190), 190,
                padded.begin() + static_cast<std::ptrdiff_t>(y * stride));
  const ImageView view{padded.data(), 190, 140, 1, PixelType::u8, stride};
  EXPECT_EQ(boxes(detect(view, everything_above(100))), flooded(image, 100));
}

TEST(Detect, ThresholdFollowsTheNoise) {
  for (const double read_e : {2.0, 20.0, 100.0}) {
    Canvas canvas(1280, 960, 200);
    Canvas::Noise noise;
    noise.read_e = read_e;
    noise.black_dn = 20;
    Random random(3);
    EXPECT_EQ(detect(canvas.image(noise, &random).view()).size(), 0u) << read_e;
    const double sigma_e = std::hypot(std::sqrt(200), read_e);
    canvas.add_spot({640.3, 480.6}, 1.2, 200 * sigma_e);  // peak about 20 sigma
    EXPECT_EQ(detect(canvas.image(noise, &random).view()).size(), 1u) << read_e;
  }
}

// A gamma curve spreads the dark noise over many grey levels, and clips it at black.
TEST(Detect, NoiseOfGammaCodedImagesIsNotDetected) {
  const Rigid3 pose = look_at({2.1, 1.9, 0.5}, {2.0, 2.1, 3.0}, {0.2, 1, 0});
  for (const int bits : {8, 12})
    for (const Response response : {Response::gamma, Response::srgb}) {
      Scene scene = test::irregular_room();
      scene.sensor.response = response;
      scene.sensor.bit_depth = bits;
      scene.sensor.gain_dn_per_e *= bits == 8 ? 1 : 16;
      for (std::uint64_t seed = 0; seed < 20; ++seed) {
        SimulateOptions options;
        options.seed = seed;
        const Image image = simulate(scene, pose, options).image;
        DetectOptions knowing;
        knowing.sensor = scene.sensor;
        EXPECT_EQ(detect(image.view(), knowing).size(), 6u) << bits << " bits, seed " << seed;
        EXPECT_EQ(detect(image.view()).size(), 6u) << bits << " bits, seed " << seed;
      }
    }
}

TEST(Detect, ShiftedBitsAreNotNoise) {
  Canvas canvas(640, 480, 100);
  Canvas::Noise noise;
  noise.gain_dn_per_e = 0.03;  // noise of a third of a 12-bit step
  noise.full_scale_dn = 4095;
  Random random(8);
  for (const int step : {1, 16}) {
    Image image = canvas.image(noise, &random);
    for (std::uint16_t& pixel : image.u16) pixel = static_cast<std::uint16_t>(step * pixel);
    DetectOptions options;
    options.min_area_px = 2;
    EXPECT_EQ(detect(image.view(), options).size(), 0u) << step;
  }
}

TEST(Detect, ABackgroundGradientIsNotDetected) {
  Canvas canvas(640, 480);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) canvas.at(x, y) = 2 * x + 3 * y;
  canvas.add_spot({320.25, 240.75}, 1, 20000);
  Random random(4);
  const std::vector<Blob> blobs = detect(canvas.image({}, &random).view());
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_LT((blobs[0].centroid_px - Eigen::Vector2d(320.25, 240.75)).norm(), 0.05);
  EXPECT_NEAR(blobs[0].background_dn, 5 + 0.05 * (2 * 320 + 3 * 240), 2);
}

TEST(Detect, SortedByFluxAndLimitedInNumber) {
  Canvas canvas(400, 100);
  for (int i = 0; i < 10; ++i) canvas.add_spot({20.0 + 40 * i, 50}, 1, 3000 + 1000 * i);
  Random random(5);
  const Image image = canvas.image({}, &random);
  std::vector<Blob> blobs = detect(image.view());
  ASSERT_EQ(blobs.size(), 10u);
  for (std::size_t i = 0; i < 10; ++i)
    EXPECT_NEAR(blobs[i].centroid_px.x(), 20.0 + 40 * static_cast<double>(9 - i), 1);
  DetectOptions options;
  options.max_blobs = 3;
  blobs = detect(image.view(), options);
  ASSERT_EQ(blobs.size(), 3u);
  EXPECT_NEAR(blobs[2].centroid_px.x(), 20 + 40 * 7, 1);
}

TEST(Detect, SmallBlobsAreDropped) {
  Canvas canvas(100, 100);
  canvas.at(50, 50) = 4000;  // a hot pixel
  const Image image = canvas.image({}, nullptr);
  EXPECT_EQ(detect(image.view()).size(), 0u);
  DetectOptions options;
  options.min_area_px = 1;
  EXPECT_EQ(detect(image.view(), options).size(), 1u);
}

TEST(Detect, FlagsSaturatedCutAndMergedBlobs) {
  Canvas canvas(300, 200);
  canvas.add_disc({60, 60}, 15, 15, 0, 0.8, 20000);   // five times full scale
  canvas.add_disc({150, 2}, 15, 15, 0, 0.8, 4000);    // over the border
  canvas.add_disc({220, 120}, 15, 15, 0, 0.8, 2000);  // two that overlap
  canvas.add_disc({238, 130}, 15, 15, 0, 0.8, 2000);
  canvas.add_disc({60, 140}, 15, 15, 0, 0.8, 4000);  // an ordinary one
  Random random(6);
  const std::vector<Blob> blobs = detect(canvas.image({}, &random).view());
  ASSERT_EQ(blobs.size(), 4u);
  for (const Blob& blob : blobs) {
    const double x = blob.centroid_px.x(), y = blob.centroid_px.y();
    EXPECT_EQ(blob.saturated, x < 100 && y < 100) << x << " " << y;
    EXPECT_EQ(blob.cut_by_border, y < 20) << x << " " << y;
    EXPECT_EQ(blob.merged, x > 200) << x << " " << y;
    EXPECT_EQ(blob.rim.empty(), blob.merged) << x << " " << y;
  }
}

TEST(Detect, ResultIsIndependentOfColourAndBitDepth) {
  Canvas canvas(80, 60, 100);
  canvas.add_spot({30.3, 25.6}, 1.1, 9000);
  Random random(7);
  const Image grey = canvas.image({}, &random);
  std::vector<std::uint16_t> colour;
  for (const std::uint8_t v : grey.u8) {
    const auto wide = static_cast<std::uint16_t>(257 * v);
    colour.insert(colour.end(), {wide, wide, wide, 0});
  }
  const ImageView view{colour.data(), 80, 60, 4, PixelType::u16, 80 * 8};
  const std::vector<Blob> a = detect(grey.view()), b = detect(view);
  ASSERT_EQ(a.size(), 1u);
  ASSERT_EQ(b.size(), 1u);
  EXPECT_LT((a[0].centroid_px - b[0].centroid_px).norm(), 2e-3);
  EXPECT_NEAR(b[0].flux_dn / a[0].flux_dn, 257, 1);
}

TEST(Detect, ALineOfPixelsHasACovariance) {
  for (const bool column : {true, false}) {
    Canvas canvas(50, 50);
    for (int i = 20; i < 30; ++i) (column ? canvas.at(25, i) : canvas.at(i, 25)) = 4000;
    const std::vector<Blob> blobs = detect(canvas.image({}, nullptr).view());
    ASSERT_EQ(blobs.size(), 1u);
    EXPECT_GT(blobs[0].covariance_px2.determinant(), 0);
  }
}

// A threshold below the background gives components of any shape, some with negative light.
TEST(Detect, ResultsAreFiniteForAnyThreshold) {
  Random random(9);
  for (int trial = 0; trial < 200; ++trial) {
    Image image;
    image.width = 40;
    image.height = 30;
    for (int i = 0; i < image.width * image.height; ++i)
      image.u8.push_back(static_cast<std::uint8_t>(random.uniform(0, 1) < 0.6 ? 100 : 99));
    for (const Blob& blob : detect(image.view(), everything_above(99))) {
      EXPECT_TRUE(blob.centroid_px.allFinite());
      EXPECT_TRUE(blob.covariance_px2.allFinite());
      EXPECT_GT(blob.covariance_px2.determinant(), 0);
      EXPECT_TRUE(std::isfinite(blob.ellipse.semi_major_px + blob.ellipse.semi_minor_px));
    }
  }
}

TEST(Detect, NoBlobsInFlatTinyOrLongImages) {
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 3}, {3, 1}, {7, 7}, {100000, 1}, {1, 100000}, {640, 480}}) {
    for (const int level : {0, 1, 128, 255}) {
      const std::vector<std::uint8_t> pixels(
          static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
          static_cast<std::uint8_t>(level));
      const ImageView view{
          pixels.data(), width, height, 1, PixelType::u8, static_cast<std::size_t>(width)};
      EXPECT_TRUE(detect(view).empty()) << width << " x " << height << ", " << level;
    }
  }
}

TEST(Detect, RejectsInvalidImages) {
  const std::vector<std::uint8_t> pixels(100, 0);
  const auto refused = [&](ImageView view) { return complaint([&] { detect(view); }); };
  EXPECT_NE(refused({nullptr, 10, 10, 1, PixelType::u8, 10}), "");
  EXPECT_NE(refused({pixels.data(), 0, 10, 1, PixelType::u8, 10}), "");
  EXPECT_NE(refused({pixels.data(), 10, 10, 2, PixelType::u8, 20}), "");
  EXPECT_NE(refused({pixels.data(), 10, 10, 1, PixelType::u8, 9}), "");
}

TEST(Detect, RejectsInvalidOptionsByName) {
  const std::vector<std::uint8_t> pixels(100, 0);
  const ImageView view{pixels.data(), 10, 10, 1, PixelType::u8, 10};
  const auto complaint_of = [&](auto&& change) {
    DetectOptions options;
    change(options);
    return complaint([&] { detect(view, options); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  using O = DetectOptions;
  EXPECT_NE(complaint_of([&](O& o) { o.threshold_sigma = nan; }).find("threshold_sigma"),
            std::string::npos);
  EXPECT_NE(complaint_of([](O& o) { o.threshold_dn = -1; }).find("threshold_dn must be"),
            std::string::npos);
  EXPECT_NE(complaint_of([](O& o) { o.min_area_px = 0; }).find("min_area_px"), std::string::npos);
  EXPECT_NE(complaint_of([](O& o) { o.max_blobs = 0; }).find("max_blobs"), std::string::npos);
  EXPECT_NE(complaint_of([](O& o) { o.max_frequency_hz = 0; }).find("max_frequency_hz"),
            std::string::npos);
  EXPECT_NE(complaint_of([](O& o) { o.stripes = true; }).find("sensor"), std::string::npos);
}

}  // namespace
}  // namespace occ
