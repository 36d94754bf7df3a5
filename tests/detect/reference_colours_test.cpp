// SPDX-License-Identifier: Apache-2.0
// Blobs of blinking and of coloured lamps, compared with those of an earlier version.
#include <gtest/gtest.h>

#include "tests/detect/reference_images.hpp"

namespace occ::test {
namespace {

Sensor rolling_sensor(Random& random) {
  Sensor sensor;
  sensor.bit_depth = chance(random, 0.7) ? 8 : 12;
  const double unit = sensor.full_scale_dn() / 255;
  sensor.row_time_s = 1 / random.uniform(15000, 60000);
  sensor.exposure_s = log_even(random, 3e-5, 3e-4);
  sensor.gain_dn_per_e = unit * 0.02;
  sensor.read_noise_e = random.uniform(20, 60);
  sensor.black_level_dn = unit * random.below(3);
  sensor.full_well_e = 13000;
  if (chance(random, 0.3)) sensor.response = Response::srgb;
  if (chance(random, 0.4)) sensor.readout = Readout::columns;
  return sensor;
}

PaintedLamp blinking_lamp(const PaintedImage& painting, Random& random) {
  PaintedLamp lamp;
  lamp.centre = {random.uniform(30, painting.width - 30.0),
                 random.uniform(30, painting.height - 30.0)};
  lamp.semi.x() = random.uniform(14, 60);
  lamp.semi.y() = lamp.semi.x() * random.uniform(0.4, 1);
  lamp.angle_rad = random.uniform(0, 3);
  const int shape = random.below(5);
  if (shape == 2) lamp.shape = PaintedShape::rectangle;
  if (shape >= 3) lamp.shape = PaintedShape::gaussian;
  if (shape >= 3) lamp.semi *= 0.6;
  lamp.level_dn = painting.sensor.full_scale_dn() * log_even(random, 0.2, 1.5);
  // The range is from below one stripe on the lamp to two lines per stripe.
  lamp.frequency_hz = log_even(random, 0.045, 0.4) / painting.sensor.row_time_s;
  lamp.phase = random.uniform();
  lamp.duty = random.uniform(0.2, 0.8);
  if (chance(random, 0.3)) lamp.depth = random.uniform(0.1, 1);
  if (chance(random, 0.1)) lamp.frequency_hz = 0;
  return lamp;
}

TEST(References, BlobsOfBlinkingLamps) {
  References references("detect/stripes");
  for (std::uint64_t i = 0; i < 130; ++i) {
    Random random(41, i);
    PaintedImage painting;
    painting.width = 150 + random.below(120);
    painting.height = 150 + random.below(120);
    painting.sensor = rolling_sensor(random);
    painting.blur_px = random.uniform(0.6, 1.3);
    const int count = chance(random, 0.6) ? 1 : 2 + random.below(2);
    for (int k = 0; k < count; ++k) painting.lamps.push_back(blinking_lamp(painting, random));
    if (i % 9 == 0)
      for (PaintedLamp& lamp : painting.lamps) lamp.semi *= 0.2;
    if (chance(random, 0.2)) {  // its reflection by a wall
      PaintedLamp reflection = painting.lamps.front();
      reflection.shape = PaintedShape::gaussian;
      reflection.semi = {25, 12};
      reflection.level_dn *= 0.06;
      reflection.centre.x() = reflection.centre.x() > 100 ? 40 : 130;
      painting.lamps.push_back(reflection);
    }
    const Image image = painted(painting, random);
    DetectOptions options;
    options.sensor = painting.sensor;
    if (chance(random, 0.3)) options.sensor->readout = Readout::unknown;
    if (chance(random, 0.1)) options.max_frequency_hz = 3000;
    if (chance(random, 0.1)) options.threshold_dn = 0.1 * painting.sensor.full_scale_dn();
    if (chance(random, 0.1)) options.rims = false;
    if (chance(random, 0.05)) options.stripes = false;
    references.add("image " + std::to_string(i), results_of(detect(image.view(), options)));
  }
  EXPECT_EQ(references.differences(), "");
}

// Weak stripes, few stripes, and noise: limits of what is read as a frequency.
TEST(References, BlobsOfWeakStripes) {
  References references("detect/weak_stripes");
  for (std::uint64_t i = 0; i < 160; ++i) {
    Random random(43, i);
    PaintedImage painting;
    painting.width = painting.height = 100 + random.below(60);
    painting.sensor = rolling_sensor(random);
    painting.sensor.read_noise_e = log_even(random, 10, 150);
    painting.blur_px = random.uniform(0.6, 1.3);
    PaintedLamp lamp = blinking_lamp(painting, random);
    lamp.centre = {random.uniform(40, painting.width - 40.0), 0.5 * painting.height};
    lamp.semi *= 0.7;
    if (i % 3 != 0) lamp.shape = PaintedShape::gaussian;
    lamp.depth = log_even(random, 0.1, 1);
    lamp.gradient = Eigen::Vector2d(random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02));
    painting.lamps = {lamp};
    const Image image = painted(painting, random);
    DetectOptions options;
    options.sensor = painting.sensor;
    references.add("image " + std::to_string(i), results_of(detect(image.view(), options)));
  }
  EXPECT_EQ(references.differences(), "");
}

Eigen::Vector3d random_colour(Random& random) {
  const Eigen::Vector3d colours[] = {{1, 0.1, 0.05}, {0.1, 1, 0.2}, {0.05, 0.2, 1},
                                     {1, 0.7, 0.1},  {1, 0.9, 0.8}, {0.6, 0.1, 1}};
  Eigen::Vector3d colour = colours[random.below(6)];
  for (double& channel : colour) channel *= random.uniform(0.8, 1.2);
  return colour;
}

TEST(References, BlobsOfColouredLamps) {
  References references("detect/colours");
  for (std::uint64_t i = 0; i < 120; ++i) {
    Random random(42, i);
    PaintedImage painting;
    painting.width = 120 + random.below(80);
    painting.height = 90 + random.below(60);
    painting.channels = chance(random, 0.8) ? 3 : 4;
    painting.sensor = random_painted_sensor(random);
    if (chance(random, 0.3)) painting.sensor.response = Response::srgb;
    const double full = painting.sensor.full_scale_dn();
    painting.background_dn = full / 255 * random.uniform(0, 30);
    DetectOptions options;
    for (int k = 2 + random.below(4); k > 0; --k) {
      PaintedLamp lamp;
      lamp.centre = {random.uniform(0, painting.width), random.uniform(0, painting.height)};
      lamp.semi.x() = log_even(random, 0.8, 20);
      lamp.semi.y() = lamp.semi.x() * random.uniform(0.4, 1);
      if (chance(random, 0.3)) lamp.shape = PaintedShape::rectangle;
      if (chance(random, 0.1)) lamp.shape = PaintedShape::gaussian;
      lamp.angle_rad = random.uniform(-2, 2);
      lamp.level_dn = full * log_even(random, 0.1, 4);
      if (chance(random, 0.7)) {
        lamp.colour = random_colour(random);
        if (chance(random, 0.8)) options.colours.push_back(lamp.colour);
      }
      painting.lamps.push_back(lamp);
    }
    const Image image = painted(painting, random);
    if (chance(random, 0.6)) options.sensor = painting.sensor;
    if (chance(random, 0.1)) options.threshold_dn = 0.2 * full;
    if (chance(random, 0.1)) options.max_blobs = 2;
    if (chance(random, 0.1)) options.patterned = true;
    references.add("image " + std::to_string(i), results_of(detect(image.view(), options)));
  }
  EXPECT_EQ(references.differences(), "");
}

}  // namespace
}  // namespace occ::test
