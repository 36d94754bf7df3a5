// SPDX-License-Identifier: Apache-2.0
// Windows of pixels around blobs.
#include "libocc/refine/internal/pixel_window.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace occ {
using namespace internal::refine;
namespace {

Blob box(int x0, int y0, int x1, int y1) {
  Blob blob;
  blob.x0 = x0;
  blob.y0 = y0;
  blob.x1 = x1;
  blob.y1 = y1;
  return blob;
}

/// Image whose pixels all differ, with padded rows.
template <typename T>
struct Ramp {
  int width = 40, height = 30, channels;
  std::vector<T> data;

  explicit Ramp(int of_pixel = 1, int step = 3) : channels(of_pixel) {
    data.resize(static_cast<std::size_t>(row_values() * height));
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < channels; ++c)
          data[static_cast<std::size_t>(y * row_values() + x * channels + c)] =
              static_cast<T>((5 * x + 7 * y + step * c) % 251);
  }
  int row_values() const { return width * channels + 6; }
  ImageView view() const {
    ImageView image;
    image.data = data.data();
    image.width = width;
    image.height = height;
    image.channels = channels;
    image.type = sizeof(T) == 1 ? PixelType::u8 : PixelType::u16;
    image.row_bytes = static_cast<std::size_t>(row_values()) * sizeof(T);
    return image;
  }
  double at(int x, int y, int c = 0) const {
    return data[static_cast<std::size_t>(y * row_values() + x * channels + c)];
  }
};

template <typename T>
void expect_pixels(const Ramp<T>& image, const Sensor& sensor, const BlobWindow& window) {
  ASSERT_EQ(window.electrons.size(), static_cast<std::size_t>(window.width * window.height));
  for (int y = 0; y < window.height; ++y)
    for (int x = 0; x < window.width; ++x)
      EXPECT_NEAR(
          window.electrons[y * window.width + x],
          (image.at(window.x0 + x, window.y0 + y) - sensor.black_level_dn) / sensor.gain_dn_per_e,
          1e-4);
}

TEST(PixelWindow, ShowsABoxWithTheBackgroundAroundIt) {
  Sensor sensor;
  sensor.black_level_dn = 3;
  sensor.gain_dn_per_e = 0.4;
  const std::vector<Blob> blobs{box(12, 9, 18, 13)};
  const Ramp<std::uint8_t> bytes;
  const BlobWindow window = WindowReader(bytes.view(), sensor).read(blobs, 0);
  // At least two pixels on each side, and the same on all sides.
  const int margin = 12 - window.x0;
  EXPECT_GE(margin, 3);
  EXPECT_LE(margin, 5);
  EXPECT_EQ(window.y0, 9 - margin);
  EXPECT_EQ(window.width, 7 + 2 * margin);
  EXPECT_EQ(window.height, 5 + 2 * margin);
  expect_pixels(bytes, sensor, window);
  const Ramp<std::uint16_t> words;
  expect_pixels(words, sensor, WindowReader(words.view(), sensor).read(blobs, 0));
}

TEST(PixelWindow, EndsAtTheBorderOfTheImage) {
  Sensor sensor;
  const Ramp<std::uint8_t> image;
  const WindowReader reader(image.view(), sensor);
  const BlobWindow first = reader.read({box(1, 2, 6, 5)}, 0);
  EXPECT_EQ(first.x0, 0);
  EXPECT_EQ(first.y0, 0);
  expect_pixels(image, sensor, first);
  const BlobWindow last = reader.read({box(30, 20, 39, 29)}, 0);
  EXPECT_EQ(last.x0 + last.width, 40);
  EXPECT_EQ(last.y0 + last.height, 30);
  expect_pixels(image, sensor, last);
  EXPECT_TRUE(reader.read({box(50, 10, 55, 15)}, 0).empty());
  EXPECT_TRUE(reader.read({box(10, 50, 15, 55)}, 0).empty());
  EXPECT_TRUE(reader.read({box(-20, 10, -15, 15)}, 0).empty());
  EXPECT_TRUE(reader.read({box(10, -20, 15, -15)}, 0).empty());
}

TEST(PixelWindow, WeighsTheColoursAsABayerMosaic) {
  Sensor sensor;
  sensor.response = Response::linear;
  sensor.black_level_dn = 2;
  const Ramp<std::uint8_t> image(3, 20);
  const BlobWindow window = WindowReader(image.view(), sensor).read({box(12, 9, 18, 13)}, 0);
  for (int y = 0; y < window.height; ++y)
    for (int x = 0; x < window.width; ++x) {
      const int u = window.x0 + x, v = window.y0 + y;
      const double mean = 0.25 * (image.at(u, v, 0) + 2 * image.at(u, v, 1) + image.at(u, v, 2));
      EXPECT_NEAR(window.electrons[y * window.width + x], (mean - 2) / sensor.gain_dn_per_e,
                  1e-3 * mean / sensor.gain_dn_per_e);
    }
}

TEST(PixelWindow, HasNoPixelsNearOtherBlobs) {
  Sensor sensor;
  const Ramp<std::uint8_t> image;
  const Blob blob = box(12, 9, 18, 13), right = box(20, 12, 24, 20), ring = box(2, 2, 30, 25);
  const WindowReader reader(image.view(), sensor);
  const BlobWindow window = reader.read({ring, right, blob}, 2);
  int kept = 0;
  for (int y = 0; y < window.height; ++y)
    for (int x = 0; x < window.width; ++x) {
      const int dx = std::max({0, right.x0 - window.x0 - x, window.x0 + x - right.x1});
      const int dy = std::max({0, right.y0 - window.y0 - y, window.y0 + y - right.y1});
      const int distance = std::max(dx, dy);
      const bool is_nan = std::isnan(window.electrons[y * window.width + x]);
      EXPECT_TRUE(is_nan || distance > 2) << x << " " << y;
      EXPECT_FALSE(is_nan && distance >= 4) << x << " " << y;
      kept += !is_nan;
    }
  EXPECT_GT(kept, 50);
  // Also on the other sides.
  const Blob left_above = box(4, 3, 10, 7);
  const BlobWindow other = reader.read({left_above, blob}, 1);
  EXPECT_TRUE(std::isnan(other.electrons[0]));
  EXPECT_FALSE(std::isnan(other.electrons.back()));
  EXPECT_FALSE(std::isnan(other.electrons[static_cast<std::size_t>(other.width) - 1]));
  // A blob around this one that ends inside its box on one side is no ring.
  for (const Blob& part :
       {box(13, 2, 30, 25), box(2, 10, 30, 25), box(2, 2, 17, 25), box(2, 2, 30, 12)}) {
    const BlobWindow cut = reader.read({part, blob}, 1);
    EXPECT_TRUE(std::isnan(cut.electrons[cut.electrons.size() / 2]));
  }
}

TEST(PixelWindow, InvertsTheResponse) {
  Sensor sensor;
  sensor.response = Response::srgb;
  const Ramp<std::uint8_t> image;
  const BlobWindow window = WindowReader(image.view(), sensor).read({box(12, 9, 18, 13)}, 0);
  for (int y = 0; y < window.height; ++y)
    for (int x = 0; x < window.width; ++x) {
      const double stored = image.at(window.x0 + x, window.y0 + y);
      const double electrons = sensor.linear_dn(stored) / sensor.gain_dn_per_e;
      EXPECT_NEAR(window.electrons[y * window.width + x], electrons, 1e-5 * electrons + 1e-4);
    }
  // Grey levels above full scale are read as full scale.
  Sensor narrow = sensor;
  narrow.bit_depth = 6;
  const BlobWindow clipped = WindowReader(image.view(), narrow).read({box(12, 9, 18, 13)}, 0);
  const double full = narrow.linear_dn(63) / narrow.gain_dn_per_e;
  for (int y = 0; y < clipped.height; ++y)
    for (int x = 0; x < clipped.width; ++x)
      if (image.at(clipped.x0 + x, clipped.y0 + y) > 63) {
        EXPECT_NEAR(clipped.electrons[y * clipped.width + x], full, 1e-5 * full);
      }
}

}  // namespace
}  // namespace occ
