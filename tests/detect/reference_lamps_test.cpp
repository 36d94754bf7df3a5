// SPDX-License-Identifier: Apache-2.0
// Blobs of random images, compared with those of an earlier version.
#include <gtest/gtest.h>

#include "libocc/detect/detect_windows.hpp"
#include "tests/detect/reference_images.hpp"

namespace occ::test {
namespace {

Eigen::Vector2d random_px(const PaintedImage& painting, Random& random, double margin_px) {
  return {random.uniform(-margin_px, painting.width + margin_px),
          random.uniform(-margin_px, painting.height + margin_px)};
}

PaintedLamp random_painted_lamp(const PaintedImage& painting, Random& random, double max_px) {
  PaintedLamp lamp;
  lamp.centre = random_px(painting, random, 4);
  lamp.semi.x() = log_even(random, 0.6, max_px);
  lamp.semi.y() = lamp.semi.x() * random.uniform(0.35, 1);
  lamp.angle_rad = random.uniform(-2, 2);
  const double full = painting.sensor.full_scale_dn();
  lamp.level_dn = full * log_even(random, 0.05, 2);
  if (chance(random, 0.5))
    lamp.gradient =
        0.3 / lamp.semi.x() * Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1));
  return lamp;
}

PaintedImage random_painting(Random& random) {
  PaintedImage painting;
  painting.width = 150 + random.below(140);
  painting.height = 110 + random.below(80);
  painting.sensor = random_painted_sensor(random);
  const double unit = painting.sensor.full_scale_dn() / 255;
  painting.blur_px = random.uniform(0.5, 1.5);
  painting.background_dn = unit * random.uniform(0, 12);
  if (chance(random, 0.3))
    painting.background_slope = unit * Eigen::Vector2d(random.uniform(-0.05, 0.05), 0.02);
  if (chance(random, 0.2)) painting.haze_dn = unit * random.uniform(5, 40);
  return painting;
}

DetectOptions random_options(const PaintedImage& painting, Random& random) {
  DetectOptions options;
  if (chance(random, 0.65)) options.sensor = painting.sensor;
  if (options.sensor && chance(random, 0.5)) options.sensor->psf_sigma_px = painting.blur_px;
  options.threshold_sigma = chance(random, 0.3) ? random.uniform(3, 12) : 5;
  if (chance(random, 0.15))
    options.threshold_dn = painting.sensor.full_scale_dn() * random.uniform(0.1, 0.4);
  if (chance(random, 0.2)) options.min_area_px = 1 + random.below(12);
  if (chance(random, 0.15)) options.max_blobs = 1 + random.below(4);
  options.rims = !chance(random, 0.1);
  options.polygons = !chance(random, 0.1);
  options.patterned = chance(random, 0.1);
  return options;
}

void add_image(References& references, std::uint64_t i, const PaintedImage& painting,
               Random& random) {
  const Image image = painted(painting, random);
  references.add("image " + std::to_string(i),
                 results_of(detect(image.view(), random_options(painting, random))));
}

TEST(References, BlobsOfSpotsAndDiscs) {
  References references("detect/discs");
  for (std::uint64_t i = 0; i < 160; ++i) {
    Random random(31, i);
    PaintedImage painting = random_painting(random);
    if (i % 7 == 0) painting.channels = i % 2 == 0 ? 3 : 4;
    const int count = 1 + random.below(9);
    for (int k = 0; k < count; ++k) {
      painting.lamps.push_back(random_painted_lamp(painting, random, i % 3 == 0 ? 40 : 14));
      PaintedLamp& lamp = painting.lamps.back();
      if (chance(random, 0.15)) lamp.shape = PaintedShape::gaussian;
      if (chance(random, 0.15)) lamp.shape = PaintedShape::ring;
      if (!chance(random, 0.2)) continue;
      PaintedLamp neighbour = lamp;  // two lamps in one blob
      neighbour.centre += 1.6 * lamp.semi.x() * Eigen::Vector2d(std::cos(i), std::sin(i));
      neighbour.level_dn *= random.uniform(0.5, 1);
      painting.lamps.push_back(neighbour);
    }
    add_image(references, i, painting, random);
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, BlobsOfPolygons) {
  References references("detect/polygons");
  for (std::uint64_t i = 0; i < 150; ++i) {
    Random random(32, i);
    PaintedImage painting = random_painting(random);
    const int count = 1 + random.below(4);
    for (int k = 0; k < count; ++k) {
      PaintedLamp lamp = random_painted_lamp(painting, random, 50);
      lamp.shape = chance(random, 0.75)  ? PaintedShape::rectangle
                   : chance(random, 0.5) ? PaintedShape::triangle
                                         : PaintedShape::hexagon;
      lamp.semi.x() = log_even(random, 4, lamp.shape == PaintedShape::rectangle ? 60 : 20);
      lamp.semi.y() = lamp.semi.x() * log_even(random, 0.05, 1);
      if (chance(random, 0.7)) lamp.level_dn = 0.4 * painting.sensor.full_scale_dn();
      lamp.gradient *= 0.5;
      painting.lamps.push_back(lamp);
    }
    add_image(references, i, painting, random);
  }
  EXPECT_EQ(references.differences(), "");
}

// Lamps close to the camera, lit walls, and lamps in front of them.
TEST(References, BlobsOfLargeLampsAndWalls) {
  References references("detect/walls");
  for (std::uint64_t i = 0; i < 36; ++i) {
    Random random(33, i);
    PaintedImage painting = random_painting(random);
    painting.width = 520 + 32 * random.below(8);
    painting.height = 400 + 32 * random.below(6);
    PaintedLamp large = random_painted_lamp(painting, random, 40);
    large.semi.x() = random.uniform(70, 260);
    large.semi.y() = large.semi.x() * random.uniform(0.4, 1);
    if (chance(random, 0.4)) large.shape = PaintedShape::rectangle;
    if (chance(random, 0.3)) large.shape = PaintedShape::gaussian;
    large.level_dn = painting.sensor.full_scale_dn() * random.uniform(0.1, 0.7);
    large.gradient *= 0.5;
    painting.lamps = {large};
    for (int k = random.below(4); k > 0; --k) {
      painting.lamps.push_back(random_painted_lamp(painting, random, 25));
      if (chance(random, 0.5))
        painting.lamps.back().centre = large.centre + random_px(painting, random, 0) / 8;
    }
    add_image(references, i, painting, random);
  }
  EXPECT_EQ(references.differences(), "");
}

// Pairs of tubes, louvres and frames.
TEST(References, BlobsOfPatternedLamps) {
  References references("detect/patterned");
  for (std::uint64_t i = 0; i < 110; ++i) {
    Random random(34, i);
    PaintedImage painting = random_painting(random);
    const double angle = random.uniform(-1.5, 1.5);
    const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
    const Eigen::Vector2d middle = random_px(painting, random, -40);
    const int rows = 1 + random.below(4), columns = 1 + random.below(3);
    const double width = random.uniform(3, 12), height = random.uniform(2, 6);
    const double gap = random.uniform(0.5, 6);
    for (int r = 0; r < rows; ++r)
      for (int c = 0; c < columns; ++c) {
        PaintedLamp cell;
        cell.shape = PaintedShape::rectangle;
        cell.semi = {width, height};
        cell.angle_rad = angle;
        cell.level_dn = painting.sensor.full_scale_dn() * random.uniform(0.2, 0.9);
        cell.centre = middle + c * (2 * width + gap) * along + r * (2 * height + gap) * across;
        painting.lamps.push_back(cell);
      }
    if (chance(random, 0.4)) painting.lamps.push_back(random_painted_lamp(painting, random, 12));
    const Image image = painted(painting, random);
    DetectOptions options = random_options(painting, random);
    options.patterned = true;
    references.add("image " + std::to_string(i), results_of(detect(image.view(), options)));
  }
  EXPECT_EQ(references.differences(), "");
}

// Thousands of components of noise, with lamps across them, in images with padded rows.
TEST(References, BlobsOfNoise) {
  References references("detect/noise");
  for (std::uint64_t i = 0; i < 40; ++i) {
    Random random(36, i);
    PaintedImage painting = random_painting(random);
    painting.width = i % 4 == 0 ? 1 + random.below(70) : 200 + random.below(200);
    painting.height = i % 4 == 1 ? 1 + random.below(70) : 150 + random.below(150);
    for (int k = random.below(4); k > 0; --k) {
      painting.lamps.push_back(random_painted_lamp(painting, random, 60));
      painting.lamps.back().shape = PaintedShape::ring;
    }
    const Image image = painted(painting, random);
    ImageView view = image.view();
    if (i % 3 == 0 && painting.width > 10) {
      view.width -= 7;
      view.row_bytes = image.view().row_bytes;
    }
    DetectOptions options = random_options(painting, random);
    options.threshold_sigma = random.uniform(0.8, 3);
    options.min_area_px = 1 + random.below(3);
    options.max_blobs = i % 2 == 0 ? 4096 : 1 + random.below(300);
    options.rims = i % 5 == 0;
    references.add("image " + std::to_string(i), results_of(detect(view, options)));
  }
  EXPECT_EQ(references.differences(), "");
}

TEST(References, BlobsInWindowsAndOfDarkDiscs) {
  References references("detect/windows");
  for (std::uint64_t i = 0; i < 50; ++i) {
    Random random(35, i);
    PaintedImage painting = random_painting(random);
    for (int k = 0; k < 6; ++k) painting.lamps.push_back(random_painted_lamp(painting, random, 12));
    Image image = painted(painting, random);
    DetectOptions options = random_options(painting, random);
    std::vector<PixelWindow> windows;
    for (int k = 2 + random.below(4); k > 0; --k) {
      const int x = random.below(painting.width) - 20, y = random.below(painting.height) - 20;
      windows.push_back({x, y, x + 20 + random.below(80), y + 20 + random.below(80)});
    }
    const WindowBlobs found = detect_in_windows(image.view(), windows, options);
    CaseResults results;
    add_blobs(results, found.blobs);
    results.add("cut", found.cut);
    for (std::uint8_t& value : image.u8) value = static_cast<std::uint8_t>(255 - value);
    for (std::uint16_t& value : image.u16) value = static_cast<std::uint16_t>(65535 - value);
    options.sensor.reset();
    options.dark = true;
    add_blobs(results, detect(image.view(), options));
    references.add("image " + std::to_string(i), results);
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
