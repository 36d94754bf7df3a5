// SPDX-License-Identifier: Apache-2.0
// Noise of the renderer: its distribution, compared with the sensor model, and its dependencies.
#include <algorithm>
#include <cmath>
#include <map>

#include "tests/support/simulate_support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

using Levels = std::vector<int>;

Levels levels_of(const Image& image) {
  return image.type == PixelType::u8 ? Levels(image.u8.begin(), image.u8.end())
                                     : Levels(image.u16.begin(), image.u16.end());
}

Levels render(const Scene& scene, std::uint64_t seed, std::uint32_t frame = 0) {
  SimulateOptions options;
  options.seed = seed;
  options.frame = frame;
  return levels_of(simulate(scene, Rigid3{}, options).image);
}

// A lamp that fills the image almost evenly.
Scene bright_scene(double electrons) {
  Scene scene;
  scene.camera = Camera::pinhole(160, 120, 5000, 5000, 79.5, 59.5);
  scene.lamps = {disc_lamp(0, {0, 0, 2}, 1)};
  Sensor& sensor = scene.sensor;
  sensor.bit_depth = 12;
  sensor.gain_dn_per_e = 0.35;
  sensor.read_noise_e = 6;
  sensor.black_level_dn = 20;
  sensor.exposure_s *= electrons / mean_electrons(scene, Rigid3{}, 1e5).mean();
  return scene;
}

Scene dark_scene() {
  Scene scene;
  scene.camera = Camera::pinhole(400, 300, 500, 500, 199.5, 149.5);
  return scene;
}

double normal_below(double z) { return 0.5 * std::erfc(-z * std::sqrt(0.5)); }

// Probability of each grey level of a pixel with `mean` electrons and a linear response, by
// summation over electrons.
std::vector<double> level_probabilities(const Sensor& sensor, double mean) {
  std::vector<double> probability(static_cast<std::size_t>(sensor.full_scale_dn()) + 1);
  for (int n = 0; n < mean + 12 * std::sqrt(mean) + 30; ++n) {
    const double poisson =
        mean > 0 ? std::exp(n * std::log(mean) - mean - std::lgamma(n + 1)) : n == 0;
    double below = 0;
    for (std::size_t level = 0; level < probability.size(); ++level) {
      const double edge = (static_cast<double>(level) + 0.5 - sensor.black_level_dn) /
                          sensor.gain_dn_per_e;  // electrons
      const double up_to =
          level + 1 == probability.size() ? 1 : normal_below((edge - n) / sensor.read_noise_e);
      probability[level] += poisson * (up_to - below);
      below = up_to;
    }
  }
  return probability;
}

// Pearson's chi-square of the levels for these probabilities; rare levels are pooled.
testing::AssertionResult follows(const Levels& levels, const std::vector<double>& probability) {
  std::vector<double> count(probability.size());
  for (const int level : levels) ++count[level];
  double chi2 = 0, pooled_count = 0, pooled_expected = 0;
  int cells = 0;
  for (std::size_t i = 0; i < probability.size(); ++i) {
    pooled_count += count[i];
    pooled_expected += probability[i] * static_cast<double>(levels.size());
    if (pooled_expected < 10 && i + 1 < probability.size()) continue;
    if (pooled_expected > 0) chi2 += std::pow(pooled_count - pooled_expected, 2) / pooled_expected;
    pooled_count = pooled_expected = 0;
    ++cells;
  }
  const double limit = chi2_interval(cells - 1, 4).second;
  if (chi2 < limit) return testing::AssertionSuccess();
  return testing::AssertionFailure() << "chi-square " << chi2 << " of " << cells << " cells";
}

TEST(DarkPixels, FollowTheSensorModel) {
  Scene scene = dark_scene();
  for (const double dark_electrons :
       {0.0, 0.7, 30.0, 2000.0}) {  // the last one is drawn without a table
    scene.sensor.read_noise_e = 8;
    scene.sensor.dark_current_e_per_s = dark_electrons / scene.sensor.exposure_s;
    scene.sensor.black_level_dn = dark_electrons > 1000 ? 0 : 6;
    scene.sensor.gain_dn_per_e = dark_electrons > 1000 ? 0.05 : 0.2;
    const std::vector<double> truth = level_probabilities(scene.sensor, dark_electrons);
    EXPECT_TRUE(follows(render(scene, 7), truth)) << dark_electrons << " electrons";
    std::vector<double> wrong = level_probabilities(scene.sensor, dark_electrons + 0.3);
    if (dark_electrons < 1) {
      EXPECT_FALSE(follows(render(scene, 7), wrong));
    }
  }
}

TEST(DarkPixels, HaveTailsBeyondTheTablesSixteenBits) {
  // 4.5 sigma is exceeded by 3.4e-6 of the pixels, less than the resolution of 16 bits.
  Scene scene = dark_scene();
  scene.sensor.read_noise_e = 10;
  scene.sensor.gain_dn_per_e = 0.25;
  scene.sensor.black_level_dn = 50;
  const double z = (61.5 - 50) / 2.5;
  int beyond = 0;
  const int frames = 60;
  for (std::uint32_t frame = 0; frame < frames; ++frame)
    for (const int level : render(scene, 3, frame)) beyond += level >= 62;
  const double expected = frames * 400 * 300 * normal_below(-z);
  EXPECT_NEAR(beyond, expected, 4 * std::sqrt(expected));
  EXPECT_GT(expected, 10);
}

TEST(DarkPixels, WithoutReadNoiseOrDarkCurrentAreAllEqual) {
  Scene scene = dark_scene();
  scene.sensor.read_noise_e = 0;
  for (const int level : render(scene, 7)) EXPECT_EQ(level, 2);
}

TEST(DarkPixels, FollowACurvedResponse) {
  // A monotone response maps the levels of the linear signal to other levels.
  Scene scene = dark_scene();
  scene.sensor.read_noise_e = 200;
  scene.sensor.black_level_dn = 20;
  scene.sensor.response = Response::srgb;
  std::map<int, double> share;
  const Levels levels = render(scene, 7);
  for (const int level : levels) share[level] += 1.0 / static_cast<double>(levels.size());
  double seen = 0;
  for (const auto& [level, fraction] : share) {
    seen += fraction;
    const double edge_e = scene.sensor.linear_dn(level + 0.5) / scene.sensor.gain_dn_per_e;
    EXPECT_NEAR(seen, normal_below(edge_e / 200), 0.006) << level;
  }
  EXPECT_GT(share.size(), 20u);
}

TEST(LitPixels, FollowTheSensorModel) {
  for (const double electrons : {3.0, 40.0}) {
    Scene scene = bright_scene(electrons);
    scene.camera = Camera::pinhole(160, 120, 1e6, 1e6, 79.5, 59.5);  // nearly even light
    const double mean = mean_electrons(scene, Rigid3{}, 1000).mean();
    EXPECT_NEAR(mean, electrons, 0.01 * electrons);
    EXPECT_TRUE(follows(render(scene, 1), level_probabilities(scene.sensor, mean)));
    EXPECT_FALSE(follows(render(scene, 1), level_probabilities(scene.sensor, mean + 1)));
  }
}

TEST(LitPixels, PhotonTransferHasTheSlopeOfTheGain) {
  // Variance against mean over exposures; differences of two frames cancel fixed differences of
  // pixels.
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  Sensor sensor;
  for (const double electrons : {200.0, 1000.0, 3000.0, 6000.0, 9000.0}) {
    const Scene scene = bright_scene(electrons);
    sensor = scene.sensor;
    const Levels a = render(scene, 11, 0), b = render(scene, 11, 1);
    double mean = 0, variance = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      mean += 0.5 * (a[i] + b[i]) / static_cast<double>(a.size());
      variance += 0.5 * std::pow(a[i] - b[i], 2) / static_cast<double>(a.size());
    }
    const double weight = 0.5 * static_cast<double>(a.size()) / (variance * variance);
    const Eigen::Vector2d row(mean - sensor.black_level_dn, 1);
    normal += weight * row * row.transpose();
    right += weight * variance * row;
  }
  const Eigen::Matrix2d covariance = normal.inverse();
  const Eigen::Vector2d fit = covariance * right;
  EXPECT_NEAR(fit[0], sensor.gain_dn_per_e, 4 * std::sqrt(covariance(0, 0)));
  const double dark = std::pow(sensor.noise_dn(0), 2);
  EXPECT_NEAR(fit[1], dark, 4 * std::sqrt(covariance(1, 1)));
  EXPECT_LT(std::sqrt(covariance(0, 0)),
            0.01 * sensor.gain_dn_per_e);  // otherwise the test has no power
}

TEST(LitPixels, WithVeryLargeWellsKeepTheirVariance) {
  Scene scene = bright_scene(3e8);
  scene.sensor.full_well_e = 1e9;
  scene.sensor.bit_depth = 16;
  scene.sensor.gain_dn_per_e = 1e-4;
  const Levels a = render(scene, 11, 0), b = render(scene, 11, 1);
  double variance = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    variance += 0.5 * std::pow(a[i] - b[i], 2) / static_cast<double>(a.size());
  const double expected = 1e-8 * 3e8 + 1.0 / 12;
  EXPECT_NEAR(variance / expected, 1, 0.06);
}

TEST(LitPixels, ClipAtTheFullWellBeforeReadNoise) {
  Scene scene = bright_scene(3e4);
  scene.sensor.full_well_e = 8000;
  const double full = scene.sensor.grey_level(8000);
  double mean = 0, square = 0;
  for (const int level : render(scene, 5)) {
    mean += (level - full) / (160 * 120);
    square += std::pow(level - full, 2) / (160 * 120);
  }
  EXPECT_NEAR(mean, 0, 0.1);
  const double read_dn = scene.sensor.gain_dn_per_e * scene.sensor.read_noise_e;
  EXPECT_NEAR(std::sqrt(square), std::hypot(read_dn, std::sqrt(1.0 / 12)), 0.05);
}

TEST(Seed, DeterminesTheBits) {
  const Scene scene = bright_scene(500);
  const Levels first = render(scene, 1, 2);
  EXPECT_EQ(first, render(scene, 1, 2));
  const auto differing = [&](const Levels& other) {
    int count = 0;
    for (std::size_t i = 0; i < first.size(); ++i) count += first[i] != other[i];
    return count;
  };
  EXPECT_GT(differing(render(scene, 2, 2)), 15000);
  EXPECT_GT(differing(render(scene, 1, 3)), 15000);
  EXPECT_GT(differing(render(scene, 1 + (1ull << 32), 2)), 15000);

  const Scene dark = dark_scene();
  EXPECT_EQ(render(dark, 1), render(dark, 1));
  EXPECT_NE(render(dark, 1), render(dark, 2));
  EXPECT_NE(render(dark, 1, 0), render(dark, 1, 1));
}

TEST(Seed, NoiseOfAPixelDoesNotDependOnOtherLamps) {
  Scene one = dark_scene();
  one.lamps = {disc_lamp(0, {-0.3, 0, 2})};
  Scene two = one;
  two.lamps.push_back(disc_lamp(1, {0.3, 0, 2}));
  const Levels a = render(one, 1), b = render(two, 1);
  int left = 0, right = 0;  // pixels that differ
  for (std::size_t i = 0; i < a.size(); ++i) (i % 400 < 200 ? left : right) += a[i] != b[i];
  EXPECT_EQ(left, 0);
  EXPECT_GT(right, 500);
}

TEST(Seed, NeighboursAndFramesAreUncorrelated) {
  Scene scene = dark_scene();
  scene.sensor.gain_dn_per_e = 0.5;
  scene.sensor.black_level_dn = 50;
  const Levels a = render(scene, 9, 0), next = render(scene, 9, 1), other = render(scene, 10, 0);
  const auto correlation = [&](const Levels& b, std::size_t shift) {
    double sum = 0;
    for (std::size_t i = 0; i + shift < a.size(); ++i) sum += (a[i] - 50) * (b[i + shift] - 50);
    return sum / static_cast<double>(a.size()) / std::pow(scene.sensor.noise_dn(0), 2);
  };
  EXPECT_NEAR(correlation(a, 0), 1, 0.02);
  const double limit = 4.5 / std::sqrt(static_cast<double>(a.size()));
  for (const std::size_t shift : {1u, 2u, 7u, 8u, 9u, 400u})
    EXPECT_LT(std::abs(correlation(a, shift)), limit) << shift;
  EXPECT_LT(std::abs(correlation(next, 0)), limit);
  EXPECT_LT(std::abs(correlation(other, 0)), limit);
}

}  // namespace
