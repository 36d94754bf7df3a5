// SPDX-License-Identifier: Apache-2.0
// Moments of a pixel compared with sums over all its grey levels.
#include "libocc/refine/internal/pixel_noise.hpp"

#include <cmath>

#include "libocc/core/math.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::refine;
namespace {

struct Moments {
  double mean = 0, variance = 0;
};

/// Moments of the stored level of a normal signal, clipped, rounded and converted to electrons.
Moments by_levels(const Sensor& sensor, double mean_e) {
  const double sigma = std::sqrt(sensor.read_noise_e * sensor.read_noise_e + std::max(0.0, mean_e));
  const auto below = [&](int level) {  // probability of a level up to this one
    if (level < 0) return 0.0;
    if (level >= sensor.full_scale_dn()) return 1.0;
    const double bound_e = sensor.linear_dn(level + 0.5) / sensor.gain_dn_per_e;
    return 0.5 * std::erfc(-(bound_e - mean_e) / (sigma * std::sqrt(2.0)));
  };
  Moments sum;
  for (int level = 0; level <= sensor.full_scale_dn(); ++level) {
    const double p = below(level) - below(level - 1);
    const double e = sensor.linear_dn(level) / sensor.gain_dn_per_e;
    sum.mean += p * e;
    sum.variance += p * e * e;
  }
  sum.variance -= sum.mean * sum.mean;
  return sum;
}

void expect_moments(const Sensor& sensor, double from_e, double to_e, double relative) {
  const PixelNoise noise(sensor);
  for (int i = 0; i <= 60; ++i) {
    const double mean_e = from_e + (to_e - from_e) * i / 60;
    const PixelMoments moments = noise.at(mean_e);
    const Moments expected = by_levels(sensor, mean_e);
    const double sigma = std::sqrt(expected.variance);
    EXPECT_NEAR(moments.mean, expected.mean, relative * sigma) << mean_e;
    EXPECT_NEAR(moments.variance, expected.variance, 2 * relative * expected.variance) << mean_e;
    const double h = 1;
    const double slope =
        (by_levels(sensor, mean_e + h).mean - by_levels(sensor, mean_e - h).mean) / (2 * h);
    EXPECT_NEAR(moments.slope, slope, 3 * relative) << mean_e;
    EXPECT_TRUE(moments.informative);
  }
}

TEST(PixelNoise, FaintPixelsAreRoundedToFewLevels) { expect_moments(Sensor{}, 0, 800, 0.02); }

TEST(PixelNoise, BrightPixelsFollowTheStandard) {
  expect_moments(Sensor{}, 1000, 9000, 0.01);
  const Sensor sensor;
  const double gain = sensor.gain_dn_per_e;
  EXPECT_NEAR(PixelNoise(sensor).at(5000).variance * gain * gain,
              std::pow(sensor.noise_dn(5000), 2), 1e-9);
}

Sensor white_at_full_scale() {
  Sensor sensor;
  sensor.full_well_e = 1e6;
  return sensor;
}

TEST(PixelNoise, ClippedPixelsKeepTheirMeanAndVariance) {
  const Sensor sensor = white_at_full_scale();
  const double white_e = PixelNoise(sensor).white_e();
  expect_moments(sensor, white_e - 500, white_e, 0.05);
  EXPECT_FALSE(PixelNoise(sensor).at(white_e + 600).informative);
  EXPECT_LT(PixelNoise(sensor).at(white_e + 200).slope, 0.05);
}

TEST(PixelNoise, AFullWellClipsBeforeTheReadNoise) {
  const Sensor sensor;  // its full well comes before its full scale
  const PixelNoise noise(sensor);
  EXPECT_EQ(noise.white_e(), sensor.full_well_e);
  const PixelMoments half = noise.at(sensor.full_well_e);
  EXPECT_NEAR(half.slope, 0.5, 1e-9);
  EXPECT_NEAR(half.mean, sensor.full_well_e - 100 / std::sqrt(2 * pi), 1);
  EXPECT_GT(half.variance, 100);  // the read noise stays
}

TEST(PixelNoise, AResponseIsRoundedMoreCoarselyInTheLight) {
  Sensor sensor;
  sensor.response = Response::gamma;
  sensor.read_noise_e = 20;
  expect_moments(sensor, 1500, 8000, 0.02);
}

}  // namespace
}  // namespace occ
