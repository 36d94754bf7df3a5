// SPDX-License-Identifier: Apache-2.0
// Accuracy of detection: compared with the truth without noise, with the Cramer-Rao bound with
// noise; and consistency of the reported covariances.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/detect/detect_support.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::Canvas;

/// Cramer-Rao bound for the centre of a Gaussian spot under constant noise plus shot noise:
/// variance of each coordinate. It is the same for known and unknown flux, which is uncorrelated.
double spot_bound_px2(double sigma_px, double flux_e, double read_e) {
  constexpr double step = 0.02;  // much finer than a pixel: the bound hardly depends on its phase
  double information = 0;
  Canvas canvas(41, 41), shifted(41, 41);
  canvas.add_spot({20, 20}, sigma_px, flux_e);
  shifted.add_spot({20 + step, 20}, sigma_px, flux_e);
  for (int y = 0; y < 41; ++y) {
    for (int x = 0; x < 41; ++x) {
      const double slope = (shifted.at(x, y) - canvas.at(x, y)) / step;
      information += slope * slope / (canvas.at(x, y) + read_e * read_e);
    }
  }
  return 1 / information;
}

TEST(DetectAccuracy, SpotsWithoutNoise) {
  Random random(1);
  Canvas::Noise fine;
  fine.full_scale_dn = 65535;
  fine.gain_dn_per_e = 1;
  for (const double sigma : {0.6, 0.9, 1.5, 2.5}) {
    for (int trial = 0; trial < 20; ++trial) {
      Canvas canvas(60, 60, 100);
      const Eigen::Vector2d truth(random.uniform(25, 35), random.uniform(25, 35));
      canvas.add_spot(truth, sigma, 3e5 * sigma * sigma);
      const auto blobs = detect(canvas.image(fine, nullptr).view());
      ASSERT_EQ(blobs.size(), 1u);
      EXPECT_LT((blobs[0].centroid_px - truth).norm(), 3e-3) << "sigma " << sigma;
      EXPECT_NEAR(blobs[0].flux_dn / (3e5 * sigma * sigma), 1, 0.01) << "sigma " << sigma;
    }
  }
}

// With a sensor the noise is known; without one it is estimated from the image.
TEST(DetectAccuracy, SpotsReachTheBoundWithConsistentCovariances) {
  for (const bool with_sensor : {true, false}) {
    for (const double flux_e : {4000.0, 12000.0}) {
      Random random(2);
      const Canvas::Noise noise;
      const double sigma = 0.9;
      DetectOptions options;
      if (with_sensor) options.sensor = Canvas::sensor(noise, sigma);
      double squares = 0, nees = 0;
      constexpr int trials = 1500;
      for (int trial = 0; trial < trials; ++trial) {
        Canvas canvas(60, 60, 40);
        const Eigen::Vector2d truth(random.uniform(25, 35), random.uniform(25, 35));
        canvas.add_spot(truth, sigma, flux_e);
        const auto blobs = detect(canvas.image(noise, &random).view(), options);
        ASSERT_EQ(blobs.size(), 1u);
        const Eigen::Vector2d error = blobs[0].centroid_px - truth;
        squares += error.squaredNorm();
        nees += error.dot(blobs[0].covariance_px2.inverse() * error);
      }
      const double quantised_read_e = std::sqrt(
          noise.read_e * noise.read_e + 40 + 1 / (12 * noise.gain_dn_per_e * noise.gain_dn_per_e));
      const double ratio =
          std::sqrt(squares / trials / (2 * spot_bound_px2(sigma, flux_e, quantised_read_e)));
      EXPECT_LT(ratio, 1.06) << flux_e << (with_sensor ? " sensor" : "");
      EXPECT_GT(ratio, 0.94) << flux_e << (with_sensor ? " sensor" : "");
      EXPECT_NEAR(nees / (2 * trials), 1, with_sensor ? 0.12 : 0.25) << flux_e;
    }
  }
}

struct DiscErrors {
  double bias_px = 0;     ///< length of the mean error of the centre
  double sigma_px = 0;    ///< standard deviation of the centre, per coordinate
  double nees = 0;        ///< mean normalised squared error of the centre, divided by 2
  double rim_chi2 = 0;    ///< chi-square per rim point, relative to the true rim
  double size_ratio = 0;  ///< measured over true, geometric mean of the axes
};

DiscErrors disc_errors(double major, double minor, double level_e, int trials) {
  Random random(3);
  const Canvas::Noise noise;
  DetectOptions options;
  options.sensor = Canvas::sensor(noise, 0.8);
  DiscErrors out;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double squares = 0, points = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const int size = 60 + static_cast<int>(2 * major);
    Canvas canvas(size, size, 40);
    const double middle = 0.5 * size;
    const Eigen::Vector2d truth(middle + random.uniform(-1, 1), middle + random.uniform(-1, 1));
    const double angle = random.uniform(-1.5, 1.5);
    canvas.add_disc(truth, major, minor, angle, 0.8, level_e);
    const auto blobs = detect(canvas.image(noise, &random).view(), options);
    if (blobs.size() != 1 || blobs[0].rim.empty()) {
      ADD_FAILURE() << "no rim";
      return out;
    }
    const Eigen::Vector2d error = blobs[0].centroid_px - truth;
    sum += error;
    squares += error.squaredNorm();
    out.nees += error.dot(blobs[0].covariance_px2.inverse() * error) / (2 * trials);
    const Ellipse& e = blobs[0].ellipse;
    out.size_ratio += std::sqrt(e.semi_major_px * e.semi_minor_px / (major * minor)) / trials;
    for (const RimPoint& p : blobs[0].rim) {
      // Distance from the ellipse to first order: (f - 1) / |grad f|, f = |S p|^2.
      const Eigen::Vector2d d = p.px - truth;
      const double c = std::cos(angle), s = std::sin(angle);
      const Eigen::Vector2d local(c * d.x() + s * d.y(), -s * d.x() + c * d.y());
      const Eigen::Vector2d g(local.x() / (major * major), local.y() / (minor * minor));
      const double distance = (local.dot(g) - 1) / (2 * g.norm());
      out.rim_chi2 += distance * distance / (p.sigma_px * p.sigma_px);
      points += 1;
    }
  }
  out.bias_px = (sum / trials).norm();
  out.sigma_px = std::sqrt(squares / (2 * trials));
  out.rim_chi2 /= points;
  return out;
}

TEST(DetectAccuracy, RimsOfDiscsAreUnbiasedWithConsistentCovariances) {
  for (const auto& [major, minor] : {std::pair{8.0, 6.0}, {15.0, 15.0}, {20.0, 9.0}}) {
    constexpr int trials = 300;
    const DiscErrors e = disc_errors(major, minor, 3000, trials);
    SCOPED_TRACE(std::to_string(major) + " x " + std::to_string(minor));
    EXPECT_LT(e.bias_px, 4 * e.sigma_px / std::sqrt(trials));
    EXPECT_LT(e.sigma_px, 0.02);
    EXPECT_NEAR(e.nees, 1, 0.3);
    EXPECT_NEAR(e.rim_chi2, 1.05, 0.2);  // includes the errors common to all points of a rim
    EXPECT_NEAR(e.size_ratio, 1, 1e-3);
  }
}

/// Number of discs, each with a neighbour of random size, brightness and position, whose centre has
/// an error of more than six sigmas and that are not marked as merged.
int unnoticed_errors(double min_radius_px, double max_radius_px, int trials) {
  Random random(5);
  const Canvas::Noise noise;
  DetectOptions options;
  options.sensor = Canvas::sensor(noise, 0.8);
  int unnoticed = 0;
  for (int trial = 0; trial < trials; ++trial) {
    Canvas canvas(110, 110, 40);
    const double radii[] = {random.uniform(min_radius_px, max_radius_px),
                            random.uniform(min_radius_px, max_radius_px)};
    const double angle = random.uniform(-3.14, 3.14);
    const double apart = radii[0] + radii[1] + random.uniform(0.7, 10);
    Eigen::Vector2d centres[2];
    centres[0] = Eigen::Vector2d(random.uniform(54, 56), random.uniform(54, 56));
    centres[1] = centres[0] + apart * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    for (int i = 0; i < 2; ++i)
      canvas.add_disc(centres[i], radii[i], radii[i], 0, 0.8,
                      i == 0 ? 3000 : random.uniform(700, 3000));
    for (const Blob& blob : detect(canvas.image(noise, &random).view(), options)) {
      const Eigen::Vector2d first = blob.centroid_px - centres[0];
      const Eigen::Vector2d second = blob.centroid_px - centres[1];
      const Eigen::Vector2d error = first.norm() < second.norm() ? first : second;
      unnoticed += !blob.merged && error.dot(blob.covariance_px2.inverse() * error) > 36;
    }
  }
  return unnoticed;
}

TEST(DetectAccuracy, DefocusedDiscsHaveRims) {
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector2d centre(60 + random.uniform(), 60 + random.uniform());
    Canvas canvas(120, 120);
    canvas.add_disc(centre, 17, 15, 0.4, 2.5, 3000);
    const auto blobs = detect(canvas.image({}, &random).view());  // without the sensor
    ASSERT_EQ(blobs.size(), 1u);
    EXPECT_FALSE(blobs[0].rim.empty()) << trial;
    EXPECT_LT((blobs[0].centroid_px - centre).norm(), 0.06) << trial;
  }
}

TEST(DetectAccuracy, NeighboursAreDetectedOrIncludedInTheCovariance) {
  EXPECT_LE(unnoticed_errors(2.5, 6, 300), 1);
  EXPECT_LE(unnoticed_errors(5, 14, 100), 1);
}

// In a wide view, the light across a large disc varies more than a paraboloid can model.
TEST(DetectAccuracy, LargeDiscsInAWideViewAreUnbiased) {
  Random random(3);
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 600, 600, 319.5, 239.5);
  scene.lamps = {test::disc_lamp(0, Eigen::Vector3d::Zero(), 1.0 / 3)};  // 100 px at 2 m
  scene.lamps[0].power_w = 17 * pi * scene.lamps[0].area_m2();
  DetectOptions options;
  options.sensor = scene.sensor;
  double nees = 0;
  constexpr int trials = 30;
  for (std::uint64_t seed = 0; seed < trials; ++seed) {
    const Eigen::Vector3d place(random.uniform(-0.7, 0.7), random.uniform(-0.4, 0.4), 2);
    SimulateOptions simulation;
    simulation.seed = seed;
    const Rendered frame = simulate(scene, {Eigen::Matrix3d::Identity(), place}, simulation);
    const auto blobs = detect(frame.image.view(), options);
    ASSERT_FALSE(blobs.empty());
    ASSERT_FALSE(blobs[0].rim.empty());
    const Eigen::Vector2d error = blobs[0].centroid_px - frame.lamps[0].image_centre_px;
    nees += error.dot(blobs[0].covariance_px2.inverse() * error);
  }
  const auto interval = test::chi2_interval(2.0 * trials);
  EXPECT_GT(nees, interval.first);
  EXPECT_LT(nees, interval.second);
}

TEST(DetectAccuracy, AHalfOccludedDiscHasALargeCovariance) {
  Random random(4);
  for (const int hidden : {3, 6, 10}) {
    Canvas canvas(100, 100, 40);
    const Eigen::Vector2d truth(50.3, 49.6);
    canvas.add_disc(truth, 15, 15, 0, 0.8, 3000);
    for (int y = 0; y < 100; ++y)
      for (int x = 0; x < 35 + hidden; ++x) canvas.at(x, y) = 40;
    const auto blobs = detect(canvas.image({}, &random).view());
    ASSERT_EQ(blobs.size(), 1u);
    const Eigen::Vector2d error = blobs[0].centroid_px - truth;
    EXPECT_LT(error.dot(blobs[0].covariance_px2.inverse() * error), 11.8)  // three sigma
        << hidden << " px occluded, error " << error.transpose();
  }
}

}  // namespace
}  // namespace occ
