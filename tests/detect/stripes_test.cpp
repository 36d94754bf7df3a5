// SPDX-License-Identifier: Apache-2.0
// Lamps that blink under a rolling shutter, rendered by numerical integration.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <vector>

#include "libocc/core/random.hpp"
#include "libocc/detect/detect.hpp"

namespace occ {
namespace {

enum class Shape { disc, gaussian, rectangle };

struct BlinkingLamp {
  Shape shape = Shape::disc;
  Eigen::Vector2d centre{120, 120};
  Eigen::Vector2d semi{40, 40};  ///< radii of a disc, standard deviations of a Gaussian, half sides
  double angle_rad = 0;
  double peak_dn = 140;
  double frequency_hz = 3000;  ///< 0: steady
  double phase = 0;            ///< cycles
  double duty = 0.5;
  double depth = 1;  ///< modulation depth, 0..1
};

struct Set {
  int width = 240, height = 240;
  bool columns = false;
  double noise_dn = 0.7;
  double background_dn = 1;
  Sensor sensor;

  Set() {
    sensor.row_time_s = 1 / 47540.0;
    sensor.exposure_s = 6e-5;
    sensor.black_level_dn = 0;
    sensor.gain_dn_per_e = 0.02;
    sensor.full_well_e = 13000;
  }
};

/// Mean of a rectangular wave over an exposure.
double exposed(double start_s, double exposure_s, double frequency_hz, double duty) {
  const auto integral = [&](double t) {
    const double cycles = t * frequency_hz, whole = std::floor(cycles);
    return (whole * duty + std::min(cycles - whole, duty)) / frequency_hz;
  };
  return (integral(start_s + exposure_s) - integral(start_s)) / exposure_s;
}

/// Brightness 0..1 of the lamp's shape, blurred by 1 px.
double brightness(const BlinkingLamp& lamp, double x, double y) {
  const double c = std::cos(lamp.angle_rad), s = std::sin(lamp.angle_rad);
  const double dx = x - lamp.centre.x(), dy = y - lamp.centre.y();
  const Eigen::Vector2d d(c * dx + s * dy, -s * dx + c * dy);
  const Eigen::Vector2d q = d.cwiseQuotient(lamp.semi);
  const auto edge = [](double outside_px) { return 0.5 * std::erfc(outside_px / std::sqrt(2.0)); };
  if (lamp.shape == Shape::gaussian) return std::exp(-0.5 * q.squaredNorm());
  if (lamp.shape == Shape::rectangle)
    return edge(std::abs(d.x()) - lamp.semi.x()) * edge(std::abs(d.y()) - lamp.semi.y());
  const double r = q.norm();
  const double gradient = q.cwiseQuotient(lamp.semi).norm() / std::max(r, 1e-9);
  return edge((r - 1) / std::max(gradient, 1e-9));
}

Image render(const Set& set, const std::vector<BlinkingLamp>& lamps, Random& random) {
  Image image;
  image.width = set.width;
  image.height = set.height;
  image.u8.reserve(static_cast<std::size_t>(set.width * set.height));
  for (int y = 0; y < set.height; ++y) {
    for (int x = 0; x < set.width; ++x) {
      double signal = set.background_dn;
      for (const BlinkingLamp& lamp : lamps) {
        const double reach = (lamp.shape == Shape::gaussian ? 6 : 1.5) * lamp.semi.maxCoeff() + 6;
        if ((Eigen::Vector2d(x, y) - lamp.centre).cwiseAbs().maxCoeff() > reach) continue;
        double lit = 1;
        if (lamp.frequency_hz > 0) {
          const double start =
              (set.columns ? x : y) * set.sensor.row_time_s + lamp.phase / lamp.frequency_hz;
          lit = exposed(start, set.sensor.exposure_s, lamp.frequency_hz, lamp.duty);
        }
        signal += lamp.peak_dn * brightness(lamp, x, y) * (1 - lamp.depth + lamp.depth * lit);
      }
      signal += set.noise_dn * std::sqrt(1 + 0.02 * signal) * random.normal();
      double stored = signal;
      if (set.sensor.response == Response::srgb) {
        const double v = std::min(1.0, std::max(0.0, signal / 255));
        stored = 255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055);
      }
      image.u8.push_back(
          static_cast<std::uint8_t>(std::lround(std::min(255.0, std::max(0.0, stored)))));
    }
  }
  return image;
}

std::vector<Blob> detect_in(const Set& set, const Image& image) {
  DetectOptions options;
  options.sensor = set.sensor;
  options.sensor->readout = set.columns ? Readout::columns : Readout::rows;
  return detect(image.view(), options);
}

/// Errors of one lamp in one image, along and across the stripes, and in frequency.
struct Errors {
  double along_px = 0, across_px = 0, along_sigma = 0, across_sigma = 0;
  double frequency_hz = 0, frequency_sigma = 0;
};

/// The lamp must be the brightest blob and striped.
Errors errors_of(const Set& set, const BlinkingLamp& lamp, const std::vector<Blob>& blobs) {
  Errors e;
  if (blobs.empty() || !blobs[0].striped || !blobs[0].frequency_hz) {
    ADD_FAILURE() << "no striped lamp: f " << lamp.frequency_hz << " phase " << lamp.phase
                  << " blobs " << blobs.size();
    return e;
  }
  const Blob& blob = blobs[0];
  const Eigen::Vector2d error = blob.centroid_px - lamp.centre;
  const Eigen::Vector2d variance = blob.covariance_px2.diagonal();
  const int along = set.columns ? 1 : 0;
  e.along_px = error[along];
  e.across_px = error[1 - along];
  e.along_sigma = std::sqrt(variance[along]);
  e.across_sigma = std::sqrt(variance[1 - along]);
  e.frequency_hz = *blob.frequency_hz - lamp.frequency_hz;
  e.frequency_sigma = blob.frequency_sigma_hz;
  return e;
}

struct Summary {
  double worst_px = 0, nees_centre = 0, nees_frequency = 0, worst_frequency_sigmas = 0;
  int count = 0;

  void add(const Errors& e) {
    worst_px = std::max({worst_px, std::abs(e.along_px), std::abs(e.across_px)});
    nees_centre +=
        std::pow(e.along_px / e.along_sigma, 2) + std::pow(e.across_px / e.across_sigma, 2);
    const double sigmas = std::abs(e.frequency_hz) / e.frequency_sigma;
    nees_frequency += sigmas * sigmas;
    worst_frequency_sigmas = std::max(worst_frequency_sigmas, sigmas);
    ++count;
  }
};

/// Frequencies, phases, both readouts, both responses.
Summary sweep(Shape shape, const Eigen::Vector2d& semi, double peak_dn) {
  Summary summary;
  Random random(7, static_cast<std::uint64_t>(shape));
  int run = 0;
  for (const double f : {1500.0, 2000.0, 3300.0, 5000.0, 8000.0}) {
    for (int phase = 0; phase < 6; ++phase, ++run) {
      Set set;
      set.columns = run % 2 == 1;
      set.sensor.response = run % 3 == 0 ? Response::srgb : Response::linear;
      BlinkingLamp lamp;
      lamp.shape = shape;
      lamp.semi = semi;
      lamp.angle_rad = random.uniform(0, 3);
      lamp.peak_dn = peak_dn;
      lamp.centre += Eigen::Vector2d(random.uniform(-1, 1), random.uniform(-1, 1));
      lamp.frequency_hz = f * random.uniform(0.97, 1.03);
      lamp.phase = (phase + random.uniform()) / 6;
      summary.add(errors_of(set, lamp, detect_in(set, render(set, {lamp}, random))));
    }
  }
  return summary;
}

TEST(Stripes, DiscsAtAnyPhase) {
  const Summary s = sweep(Shape::disc, {40, 36}, 140);
  EXPECT_LT(s.worst_px, 0.1);
  EXPECT_LT(s.nees_centre / s.count, 3);
  EXPECT_LT(s.nees_frequency / s.count, 2);
  EXPECT_GT(s.nees_frequency / s.count, 0.02);  // the reported sigma is not far too large
  EXPECT_LT(s.worst_frequency_sigmas, 4);
}

TEST(Stripes, GaussiansAtAnyPhase) {
  const Summary s = sweep(Shape::gaussian, {22, 19}, 200);
  EXPECT_LT(s.worst_px, 0.3);
  EXPECT_LT(s.nees_centre / s.count, 3);
  EXPECT_LT(s.nees_frequency / s.count, 2);
  EXPECT_GT(s.nees_frequency / s.count, 0.02);
  EXPECT_LT(s.worst_frequency_sigmas, 4);
}

TEST(Stripes, SaturatedGaussians) {
  const Summary s = sweep(Shape::gaussian, {15, 14}, 1000);
  EXPECT_LT(s.worst_px, 0.5);
  EXPECT_LT(s.worst_frequency_sigmas, 4);
}

TEST(Stripes, RectanglesAreConsistentWithTheirSigma) {
  const Summary s = sweep(Shape::rectangle, {45, 38}, 140);
  EXPECT_LT(s.nees_centre / s.count, 3);
  EXPECT_LT(s.worst_frequency_sigmas, 4);
}

TEST(Stripes, PlainCentroidWouldBeBiased) {
  // Without the treatment of stripes, the sweeps above would measure the centroid of the lit
  // pixels.
  Random random(3);
  const Set set;
  double worst = 0;
  for (int phase = 0; phase < 6; ++phase) {
    BlinkingLamp lamp;
    lamp.frequency_hz = 2000;
    lamp.phase = phase / 6.0;
    const Image image = render(set, {lamp}, random);
    double sum = 0, first = 0;
    for (int i = 0; i < set.width * set.height; ++i) {
      const double value = image.u8[i];
      if (value < 20) continue;
      sum += value;
      first += value * (i / set.width);
    }
    worst = std::max(worst, std::abs(first / sum - lamp.centre.y()));
  }
  EXPECT_GT(worst, 1.0);
}

TEST(Stripes, WeakModulationAndOtherDuties) {
  Random random(5);
  for (const bool weak : {true, false}) {
    for (const double duty : {0.3, 0.75}) {
      Set set;
      BlinkingLamp lamp;
      lamp.depth = weak ? 0.3 : 1;
      lamp.duty = duty;
      lamp.phase = 0.2;
      const auto blobs = detect_in(set, render(set, {lamp}, random));
      const Errors e = errors_of(set, lamp, blobs);
      EXPECT_EQ(blobs.size(), 1u);
      EXPECT_LT(std::abs(e.frequency_hz), 4 * e.frequency_sigma) << duty << " " << weak;
      EXPECT_LT(e.frequency_sigma, 60);
      EXPECT_LT(std::hypot(e.along_px, e.across_px), 0.3) << duty << " " << weak;
    }
  }
}

TEST(Stripes, BlobIsComplete) {
  Random random(11);
  const Set set;
  BlinkingLamp lamp;
  lamp.semi = {44, 33};
  lamp.angle_rad = 0.5;
  const auto blobs = detect_in(set, render(set, {lamp}, random));
  ASSERT_EQ(blobs.size(), 1u);
  const Blob& blob = blobs[0];
  EXPECT_NEAR(blob.ellipse.semi_major_px, 44, 0.5);
  EXPECT_NEAR(blob.ellipse.semi_minor_px, 33, 0.5);
  EXPECT_NEAR(blob.ellipse.angle_rad, 0.5, 0.03);
  EXPECT_FALSE(blob.saturated);
  EXPECT_FALSE(blob.cut_by_border);
  EXPECT_NEAR(blob.x0, 120 - std::hypot(44 * std::cos(0.5), 33 * std::sin(0.5)), 1.5);
  EXPECT_NEAR(blob.y1, 120 + std::hypot(44 * std::sin(0.5), 33 * std::cos(0.5)), 1.5);
  // Lit half of the time: half of the lamp's light.
  EXPECT_NEAR(blob.flux_dn, 140 * 3.14159 * 44 * 33 / 2, 0.05 * 140 * 3.14159 * 44 * 33 / 2);
  ASSERT_GT(blob.rim.size(), 30u);
  for (const RimPoint& p : blob.rim) {
    const double outwards = p.normal.dot(p.px - blob.centroid_px);
    EXPECT_GT(outwards, 30);
    EXPECT_NEAR(p.normal.norm(), 1, 1e-9);
    EXPECT_GT(p.sigma_px, 0);
  }
  EXPECT_GT(blob.rim_covariance_px2(0, 0), 0);
  EXPECT_LT(blob.rim_covariance_px2(1, 1), blob.covariance_px2(0, 0) + 1e-12);
  DetectOptions options;
  options.sensor = set.sensor;
  options.rims = false;
  EXPECT_TRUE(detect(render(set, {lamp}, random).view(), options)[0].rim.empty());
}

TEST(Stripes, FlagsSaturatedAndCutLamps) {
  Random random(12);
  const Set set;
  BlinkingLamp lamp;
  lamp.peak_dn = 600;
  EXPECT_TRUE(detect_in(set, render(set, {lamp}, random)).at(0).saturated);
  lamp.peak_dn = 140;
  lamp.centre = {120, 25};
  EXPECT_TRUE(detect_in(set, render(set, {lamp}, random)).at(0).cut_by_border);
}

TEST(Stripes, ACutLampIsWithinItsSigma) {
  Random random(13);
  for (int phase = 0; phase < 6; ++phase) {
    Set set;
    set.columns = phase % 2 == 1;
    BlinkingLamp lamp;
    lamp.centre = set.columns ? Eigen::Vector2d(120, 25) : Eigen::Vector2d(25, 120);
    lamp.phase = phase / 6.0;
    const std::vector<Blob> blobs = detect_in(set, render(set, {lamp}, random));
    ASSERT_FALSE(blobs.empty());
    const Eigen::Vector2d error = blobs[0].centroid_px - lamp.centre;
    const Eigen::Vector2d sigma = blobs[0].covariance_px2.diagonal().cwiseSqrt();
    EXPECT_LT(error.cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 4) << phase;
  }
}

TEST(Stripes, TwoLampsCloseTogetherStayTwo) {
  Random random(21);
  struct Case {
    Eigen::Vector2d second;
    double f;
  };
  // Side by side; one after the other, with different and with equal frequency; diagonal.
  for (const Case& c : {Case{{152, 100}, 2600}, Case{{90, 170}, 3500}, Case{{90, 172}, 3000},
                        Case{{140, 150}, 4000}}) {
    for (const double phase : {0.0, 0.35, 0.7}) {
      Set set;
      std::vector<BlinkingLamp> lamps(2);
      lamps[0].centre = {90, 100};
      lamps[1].centre = c.second;
      lamps[0].semi = lamps[1].semi = {28, 28};
      lamps[1].frequency_hz = c.f;
      lamps[1].phase = phase;
      const auto blobs = detect_in(set, render(set, lamps, random));
      ASSERT_EQ(blobs.size(), 2u) << c.second.transpose() << " phase " << phase;
      for (const BlinkingLamp& lamp : lamps) {
        const bool first = (blobs[0].centroid_px - lamp.centre).norm() <
                           (blobs[1].centroid_px - lamp.centre).norm();
        const Blob& blob = blobs[first ? 0 : 1];
        EXPECT_LT((blob.centroid_px - lamp.centre).norm(), 0.5) << c.second.transpose();
        ASSERT_TRUE(blob.frequency_hz.has_value()) << c.second.transpose();
        EXPECT_NEAR(*blob.frequency_hz, lamp.frequency_hz, 4 * blob.frequency_sigma_hz);
        EXPECT_LT(blob.frequency_sigma_hz, 100);
      }
    }
  }
}

TEST(Stripes, SteadyLampsHaveNoFrequency) {
  Random random(31);
  for (int run = 0; run < 12; ++run) {
    Set set;
    set.columns = run % 2 == 1;
    std::vector<BlinkingLamp> lamps(2);
    for (BlinkingLamp& lamp : lamps) {
      lamp.frequency_hz = 0;
      lamp.shape = static_cast<Shape>(run % 3);
      lamp.semi = {random.uniform(8, 22), random.uniform(8, 22)};
      lamp.peak_dn = run < 6 ? 20 : 180;
    }
    lamps[0].centre = {70, 80};
    lamps[1].centre = {170, 160};
    const auto blobs = detect_in(set, render(set, lamps, random));
    EXPECT_GE(blobs.size(), 2u);
    for (const Blob& blob : blobs) {
      EXPECT_FALSE(blob.striped);
      EXPECT_FALSE(blob.frequency_hz.has_value());
      EXPECT_TRUE(std::isinf(blob.frequency_sigma_hz));
    }
  }
}

TEST(Stripes, NoiseHasNoFrequency) {
  Random random(32);
  Set set;
  set.noise_dn = 6;
  for (int run = 0; run < 4; ++run) {
    DetectOptions options;
    options.sensor = set.sensor;
    options.threshold_dn = 8;  // noise everywhere
    options.min_area_px = 1;
    for (const Blob& blob : detect(render(set, {}, random).view(), options))
      ASSERT_FALSE(blob.striped);
  }
}

TEST(Stripes, TooFewPeriodsAreJoinedWithoutAFrequency) {
  Random random(41);
  const Set set;
  for (const double phase : {0.0, 0.4, 0.8}) {
    BlinkingLamp lamp;
    lamp.semi = {30, 30};
    lamp.frequency_hz = 1350;  // 1.7 periods over the disc
    lamp.phase = phase;
    for (const Blob& blob : detect_in(set, render(set, {lamp}, random)))
      EXPECT_FALSE(blob.frequency_hz.has_value()) << phase;
  }
}

TEST(Stripes, NoFrequencyAboveTheNullOfTheExposure) {
  Random random(42);
  Set set;
  set.sensor.exposure_s =
      2.5e-4;  // first null at 4 kHz; at 6 kHz a fifth of the light still blinks
  BlinkingLamp lamp;
  lamp.frequency_hz = 6000;
  const auto blobs = detect_in(set, render(set, {lamp}, random));
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_FALSE(blobs[0].frequency_hz.has_value());
}

TEST(Stripes, ReflectionsAreRemovedAndCauseNoBias) {
  Random random(43);
  const Set set;
  std::vector<BlinkingLamp> lamps(3);
  lamps[0].semi = {36, 36};
  lamps[1].shape = Shape::gaussian;  // a streak on the wall beside the lamp, in phase with it
  lamps[1].centre = {166, 150};
  lamps[1].semi = {30, 45};
  lamps[1].peak_dn = 6;
  lamps[2].centre = {40, 200};  // and a spot on the floor
  lamps[2].semi = {25, 20};
  lamps[2].peak_dn = 9;
  const auto blobs = detect_in(set, render(set, lamps, random));
  const Errors e = errors_of(set, lamps[0], blobs);
  EXPECT_LT(std::hypot(e.along_px, e.across_px), 0.3);
  int striped = 0;
  for (const Blob& blob : blobs) striped += blob.striped;
  EXPECT_EQ(striped, 1);
}

TEST(Stripes, ReadoutDirectionIsDetected) {
  Random random(51);
  for (const bool columns : {false, true}) {
    Set set;
    set.columns = columns;
    std::vector<BlinkingLamp> lamps(2);
    lamps[0].centre = {70, 75};
    lamps[1].centre = {165, 160};
    lamps[1].frequency_hz = 4000;
    for (BlinkingLamp& lamp : lamps) lamp.semi = {35, 35};
    DetectOptions options;
    options.sensor = set.sensor;
    options.sensor->readout = Readout::unknown;
    const auto blobs = detect(render(set, lamps, random).view(), options);
    ASSERT_EQ(blobs.size(), 2u);
    for (const Blob& blob : blobs) {
      ASSERT_TRUE(blob.frequency_hz.has_value());
      const double f = blob.centroid_px.x() < 120 ? 3000 : 4000;
      EXPECT_NEAR(*blob.frequency_hz, f, 4 * blob.frequency_sigma_hz);
    }
  }
}

TEST(Stripes, OptionsHaveAnEffect) {
  Random random(52);
  Set set;
  BlinkingLamp lamp;
  const Image image = render(set, {lamp}, random);
  DetectOptions options;
  options.sensor = set.sensor;
  options.stripes = false;
  EXPECT_GT(detect(image.view(), options).size(), 3u);  // one blob for each stripe
  options.stripes = true;
  EXPECT_EQ(detect(image.view(), options).size(), 1u);
  options.max_frequency_hz = 2000;
  for (const Blob& blob : detect(image.view(), options))
    EXPECT_FALSE(blob.frequency_hz.value_or(0) > 2000);
  options.sensor->row_time_s = 0;
  EXPECT_THROW(detect(image.view(), options), std::invalid_argument);
}

TEST(Stripes, SameForColourAndSixteenBits) {
  Random random(53);
  const Set set;
  BlinkingLamp lamp;
  const Image grey = render(set, {lamp}, random);
  Image colour = grey, deep = grey;
  colour.channels = 3;
  colour.u8.clear();
  deep.type = PixelType::u16;
  deep.u8.clear();
  for (const std::uint8_t value : grey.u8) {
    colour.u8.insert(colour.u8.end(), 3, value);
    deep.u16.push_back(static_cast<std::uint16_t>(value * 16));
  }
  const auto expected = detect_in(set, grey);
  const auto of_colour = detect_in(set, colour);
  Set deep_set = set;
  deep_set.sensor.bit_depth = 12;
  deep_set.sensor.gain_dn_per_e *= 16;
  const auto of_deep = detect_in(deep_set, deep);
  ASSERT_EQ(expected.size(), 1u);
  ASSERT_EQ(of_colour.size(), 1u);
  ASSERT_EQ(of_deep.size(), 1u);
  EXPECT_LT((of_colour[0].centroid_px - expected[0].centroid_px).norm(), 0.02);
  EXPECT_LT((of_deep[0].centroid_px - expected[0].centroid_px).norm(), 0.02);
  EXPECT_NEAR(*of_colour[0].frequency_hz, *expected[0].frequency_hz, 2);
  EXPECT_NEAR(*of_deep[0].frequency_hz, *expected[0].frequency_hz, 2);
}

}  // namespace
}  // namespace occ
