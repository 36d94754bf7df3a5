// SPDX-License-Identifier: Apache-2.0
// Emission profiles against closed forms, and their smoothness.
#include "libocc/radiometry/emission_profile.hpp"

#include "libocc/radiometry/lambertian.hpp"
#include "tests/support/photometry.hpp"
#include "tests/support/support.hpp"

namespace {

using namespace occ;
using test::direction_of;

constexpr double deg = pi / 180;

TEST(EmissionProfile, AgreesWithTheCosinePower) {
  for (const double order : {1.0, 0.6, 4.0, 20.0}) {
    const auto profile = test::profile_of(test::cosine_power(order), 2.5, 0);
    EXPECT_FALSE(profile->depends_on_c());
    for (double gamma = 0; gamma < 80; gamma += 0.37) {
      const double expected = radiant_intensity(1, order, std::cos(gamma * deg));
      if (expected < 0.02 * radiant_intensity(1, order, 1)) break;
      EXPECT_NEAR(profile->density(direction_of(gamma * deg, 2)) / expected, 1, 1e-3)
          << order << " at " << gamma;
    }
    EXPECT_NEAR(profile->equivalent_order(), order, 0.01 * std::max(1.0, order));
  }
}

TEST(EmissionProfile, AgreesWithTheBatwing) {
  for (const double step : {2.5, 5.0}) {
    const auto profile = test::profile_of(test::batwing, step, 2 * step);
    EXPECT_TRUE(profile->depends_on_c());
    for (double gamma = 0; gamma < 85; gamma += 1.3)
      for (double c = 0; c < 360; c += 17.7) {
        const double expected = test::batwing(gamma * deg, c * deg) / test::batwing_flux();
        EXPECT_NEAR(profile->density(direction_of(gamma * deg, c * deg)) / expected, 1, 1e-3)
            << gamma << " " << c;
      }
  }
}

TEST(EmissionProfile, IntegralOverTheHemisphereIsOne) {
  const auto uneven = test::profile_of(
      [](double gamma, double c) { return gamma > 0.9 ? 0 : 2 + std::sin(c) * std::sin(gamma); },
      7.5, 30);
  const auto batwing = test::profile_of(test::batwing, 5, 15);
  for (const auto* profile : {&uneven, &batwing}) {
    double sum = 0;
    constexpr int rings = 900, sectors = 360;
    for (int i = 0; i < rings; ++i)
      for (int j = 0; j < sectors; ++j) {
        const double gamma = (i + 0.5) * pi / 2 / rings;
        sum += (*profile)->density(direction_of(gamma, (j + 0.5) * 2 * pi / sectors)) *
               std::sin(gamma);
      }
    EXPECT_NEAR(sum * (pi / 2 / rings) * (2 * pi / sectors), 1, 2e-5);
  }
}

TEST(EmissionProfile, MonotoneDataGiveAMonotoneCurve) {
  // A sharp cut-off, where a spline would overshoot.
  const auto profile = test::profile_of(
      [](double gamma, double) { return gamma < 1     ? 1000
                                        : gamma < 1.1 ? 300
                                                      : 0; }, 5, 0);
  double last = profile->density(direction_of(0, 0));
  EXPECT_GT(last, 0);
  for (double gamma = 0.1; gamma < 90; gamma += 0.1) {
    const double now = profile->density(direction_of(gamma * deg, 0));
    EXPECT_LE(now, last * (1 + 1e-12));
    EXPECT_GE(now, 0);
    last = now;
  }
}

TEST(EmissionProfile, GradientAgreesWithDifferencesAlsoOnTheAxis) {
  Random random(3);
  const auto coarse = test::profile_of(test::batwing, 10, 30);
  for (int i = 0; i < 400; ++i) {
    const double gamma = i < 20    ? 0
                         : i < 100 ? 1e-3 * random.uniform(0, 1)
                                   : random.uniform(0, 1.5);
    const Eigen::Vector3d direction = direction_of(gamma, random.uniform(0, 2 * pi));
    Eigen::Vector3d gradient;
    const double f = coarse->density(direction, &gradient);
    EXPECT_NEAR(gradient.dot(direction), 0, 1e-9 * gradient.norm());
    const Eigen::Vector3d across = direction.unitOrthogonal(), up = direction.cross(across);
    for (const Eigen::Vector3d& axis : {across, up}) {
      constexpr double h = 1e-5;
      const double above = coarse->density((direction + h * axis).normalized());
      const double below = coarse->density((direction - h * axis).normalized());
      EXPECT_NEAR((above - below) / (2 * h) / f, gradient.dot(axis) / f, 2e-3) << gamma;
    }
  }
}

TEST(EmissionProfile, IsContinuousOverTheNormalAndOverCZero) {
  const auto profile = test::profile_of(test::batwing, 5, 30);
  const double at = profile->density({0, 0, 1});
  for (double c = 0; c < 6.3; c += 0.1) {
    EXPECT_NEAR(profile->density(direction_of(1e-7, c)), at, 1e-6 * at);
    Eigen::Vector3d here, opposite;
    profile->density(direction_of(1e-7, c), &here);
    profile->density(direction_of(1e-7, c + pi), &opposite);
    EXPECT_NEAR((here - opposite).norm() / here.norm(), 0, 0.02);
  }
  for (double gamma = 0.1; gamma < 1.5; gamma += 0.1) {
    Eigen::Vector3d below, above;
    EXPECT_NEAR(profile->density(direction_of(gamma, -1e-9), &below),
                profile->density(direction_of(gamma, 1e-9), &above), 1e-7 * at);
    EXPECT_NEAR((below - above).norm(), 0, 1e-5 * at);
  }
}

TEST(EmissionProfile, IsDarkBehindTheLamp) {
  const auto profile = test::profile_of(test::batwing, 5, 30);
  Eigen::Vector3d gradient;
  EXPECT_EQ(profile->density({0, 0, -1}, &gradient), 0);
  EXPECT_EQ(gradient.norm(), 0);
  EXPECT_EQ(profile->density({1, 0, 0}), 0);
}

TEST(EmissionProfile, LightBehindTheLampIsIgnored) {
  PhotometricDistribution both = parse_photometry(test::lm63_text(
      [](double gamma, double) { return 3 + std::cos(2 * gamma); }, test::steps_deg(4, 180), {0}));
  const EmissionProfile profile(both);
  // 3 + cos 2g = 2 + 2 cos^2 g; its integral over the hemisphere is 2 pi (2 + 2/3).
  const double expected = 4 / (2 * pi * (2 + 2.0 / 3));
  EXPECT_NEAR(profile.density({0, 0, 1}) / expected, 1, 1e-3);
}

TEST(EmissionProfile, RejectsDistributionsWithoutLightAhead) {
  PhotometricDistribution up =
      parse_photometry(test::lm63_text(test::cosine_power(2), test::steps_deg(10, 180), {0}));
  up.intensities_cd.topRows(10).setZero();
  EXPECT_NE(test::complaint([&] { EmissionProfile profile(up); }).find("gamma below 90 degrees"),
            std::string::npos);
  up.intensities_cd(12, 0) = std::nan("");
  EXPECT_EQ(test::complaint([&] { EmissionProfile profile(up); }),
            "intensities_cd[12, 0] must be finite and >= 0, got nan");
}

}  // namespace
