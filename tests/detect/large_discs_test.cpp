// SPDX-License-Identifier: Apache-2.0
// Lamps from the smallest with a rim to one that nearly fills the image: each is one blob, measured
// without bias and with consistent covariances. Other large bright areas are not detected as lamps.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
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

constexpr int width = 1280, height = 960;

/// Sums of normalised squared errors over discs.
struct Nees {
  double centre = 0, radius = 0, stretch = 0;
  int discs = 0, rims = 0;

  void add(const Blob& blob, const Eigen::Vector2d& truth, double radius_px) {
    const Eigen::Vector2d error = blob.centroid_px - truth;
    centre += error.dot(blob.covariance_px2.inverse() * error);
    ++discs;
    if (blob.rim.empty()) return;
    double weights = 0, sum = 0;
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d stretches = Eigen::Vector2d::Zero();
    for (const RimPoint& point : blob.rim) {
      const double weight = 1 / (point.sigma_px * point.sigma_px);
      const double off = (point.px - truth).norm() - radius_px;
      weights += weight;
      sum += weight * off;
      const Eigen::Vector2d& n = point.normal;
      const Eigen::Vector2d by_stretch(square(n.x()) - square(n.y()), 2 * n.x() * n.y());
      information += weight * by_stretch * by_stretch.transpose();
      stretches += weight * off * by_stretch;
    }
    radius += std::pow(sum / weights, 2) / (1 / weights + blob.rim_covariance_px2(0, 0));
    const Eigen::Matrix2d own = information.inverse();
    const Eigen::Matrix2d covariance = own + blob.rim_covariance_px2.bottomRightCorner<2, 2>();
    const Eigen::Vector2d estimate = own * stretches;
    stretch += estimate.dot(covariance.inverse() * estimate);
    ++rims;
  }

  void expect_true(bool radii) const {
    const auto two = test::chi2_interval(2.0 * discs);
    EXPECT_GT(centre, two.first);
    EXPECT_LT(centre, two.second);
    if (!radii) return;
    const auto one = test::chi2_interval(rims);
    EXPECT_GT(radius, one.first);
    EXPECT_LT(radius, one.second);
    const auto stretches = test::chi2_interval(2.0 * rims);
    EXPECT_GT(stretch, stretches.first);
    EXPECT_LT(stretch, stretches.second);
  }
};

struct Case {
  double level_e = 3000, psf_px = 0.8;
  bool with_sensor = true;
  double off_centre = 0;  ///< offset to the right of the middle [radii]
};

Nees measure_discs(const Case& c, const std::vector<double>& radii_px, int trials,
                   std::uint64_t seed) {
  Random random(seed);
  const Canvas::Noise noise;
  DetectOptions options;
  if (c.with_sensor) options.sensor = Canvas::sensor(noise, c.psf_px);
  Nees nees;
  for (const double radius : radii_px) {
    for (int trial = 0; trial < trials; ++trial) {
      const int size = 100 + static_cast<int>(2 * radius);
      const bool whole_frame = size > height || c.off_centre > 0;
      Canvas canvas(whole_frame ? width : size, whole_frame ? height : size, 40);
      const Eigen::Vector2d truth(
          0.5 * (whole_frame ? width : size) + c.off_centre * radius + random.uniform(-2, 2),
          0.5 * canvas.height() + random.uniform(-2, 2));
      canvas.add_disc(truth, radius, radius, 0, c.psf_px, c.level_e);
      const auto blobs = detect(canvas.image(noise, &random).view(), options);
      EXPECT_EQ(blobs.size(), 1u) << radius;
      if (blobs.empty()) continue;
      EXPECT_TRUE(!blobs[0].rim.empty() || radius < 12) << radius;
      nees.add(blobs[0], truth, radius);
    }
  }
  return nees;
}

TEST(DetectLargeDiscs, AreOneBlob) {
  for (const double level_e : {200.0, 3000.0, 20000.0}) {
    const Nees nees = measure_discs({level_e, 0.8, true, level_e > 200 ? 0 : 0.6}, {300}, 1, 1);
    EXPECT_LT(nees.centre, 14) << level_e;
  }
}

// The light of a wide lens falls off by more than a paraboloid across discs from 40 px on.
TEST(DetectLargeDiscs, HaveTrueCentresInAWideView) {
  Scene scene;
  scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5);
  scene.sensor.exposure_s = 1.2e-4;
  for (const auto& [x, y] : {std::pair{-0.7, -0.2}, {0.6, 0.5}, {0.3, -0.9}}) {
    Lamp lamp;
    lamp.id = static_cast<int>(scene.lamps.size());
    lamp.centre_m = {x, y, 3};
    lamp.radius_m = 0.4;
    lamp.power_w = 6;
    scene.lamps.push_back(lamp);
  }
  DetectOptions options;
  options.sensor = scene.sensor;
  Random random(5);
  double nees = 0;
  int discs = 0;
  for (int i = 0; i < 40; ++i) {
    const Rigid3 pose = look_at(
        {random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8), random.uniform(0.3, 0.8)},
        {random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 3}, Eigen::Vector3d::UnitY());
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(i);
    const Rendered rendered = simulate(scene, pose, simulation);
    for (const Blob& blob : detect(rendered.image.view(), options)) {
      if (blob.cut_by_border || blob.rim.empty()) continue;
      for (const LampTruth& lamp : rendered.lamps) {
        const Eigen::Vector2d error = blob.centroid_px - lamp.image_centre_px;
        if (!lamp.whole || error.norm() > 3) continue;
        nees += error.dot(blob.covariance_px2.inverse() * error);
        ++discs;
      }
    }
  }
  EXPECT_GT(discs, 60);
  EXPECT_LT(nees, test::chi2_interval(2.0 * discs).second);
  EXPECT_GT(nees, test::chi2_interval(2.0 * discs).first);
}

// Normals of another ellipse, such as that of the pass before, correlate with the points' noise.
TEST(DetectLargeDiscs, NormalsAreThoseOfTheEllipse) {
  const Canvas::Noise noise;
  for (const double level_e : {3000.0, 40000.0}) {  // the second one saturates
    Random random(7);
    Canvas canvas(100, 100, 40);
    canvas.add_disc({50.3, 49.6}, 20, 14, 0.4, 0.8, level_e);
    DetectOptions options;
    options.sensor = Canvas::sensor(noise, 0.8);
    const auto blobs = detect(canvas.image(noise, &random).view(), options);
    ASSERT_EQ(blobs.size(), 1u);
    const Ellipse& ellipse = blobs[0].ellipse;
    const Eigen::Matrix2d axes = Eigen::Rotation2Dd(ellipse.angle_rad).toRotationMatrix();
    const Eigen::Vector2d inverse2(1 / square(ellipse.semi_major_px),
                                   1 / square(ellipse.semi_minor_px));
    const Eigen::Matrix2d shape = axes * inverse2.asDiagonal() * axes.transpose();
    ASSERT_GT(blobs[0].rim.size(), 20u);
    for (const RimPoint& point : blobs[0].rim) {
      const Eigen::Vector2d normal = (shape * (point.px - ellipse.centre_px)).normalized();
      EXPECT_LT((normal - point.normal).norm(), 1e-9);
    }
  }
}

TEST(DetectLargeDiscs, CentreAndShapeAreConsistent) {
  measure_discs({3000, 0.8, true, 0}, {12, 16, 22}, 60, 5).expect_true(true);
}

TEST(SlowDetectLargeDiscs, CentreAndRadiusAreConsistentFromThreeToFourHundredPixels) {
  const std::vector<double> radii = {3.6, 6, 12, 30, 75, 110, 150, 220, 300, 400};
  for (const Case& c : {Case{3000, 0.8, true, 0}, Case{3000, 0.8, false, 0},
                        Case{600, 1.5, true, 0}, Case{1500, 0.6, true, 0}}) {
    SCOPED_TRACE(std::to_string(c.level_e) + " e, psf " + std::to_string(c.psf_px) + " px");
    measure_discs(c, radii, 8, 2).expect_true(true);
  }
}

TEST(SlowDetectLargeDiscs, AreConsistentWhenCutByTheBorder) {
  for (const double off_centre : {0.9, 1.4})
    measure_discs({3000, 0.8, true, off_centre}, {350, 400}, 8, 3).expect_true(true);
}

// Saturation enlarges a rim, but does not shift its centre.
TEST(SlowDetectLargeDiscs, SaturatedCentresAreConsistent) {
  for (const double level_e : {8000.0, 40000.0})
    measure_discs({level_e, 0.8, true, 0}, {6, 12, 30, 75, 150, 300, 400}, 6, 4).expect_true(false);
}

// At a short distance, the light of a lamp decreases to half towards its rim.
TEST(SlowDetectLargeDiscs, BrightnessVariesAcrossThem) {
  Random random(3);
  Scene scene;
  scene.camera = Camera::pinhole(width, height, 700, 700, 639.5, 479.5);
  DetectOptions options;
  options.sensor = scene.sensor;
  Nees nees;
  for (const double radius_px : {120.0, 200.0, 300.0, 400.0}) {
    scene.lamps = {test::disc_lamp(0, Eigen::Vector3d::Zero(), 2 * radius_px / 700)};
    scene.lamps[0].power_w = 17 * pi * scene.lamps[0].area_m2();
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
      const double room = (470 - radius_px) / 350;
      const Eigen::Vector3d place(random.uniform(-room, room), random.uniform(-room, room), 2);
      SimulateOptions simulation;
      simulation.seed = seed;
      const Rendered frame = simulate(scene, {Eigen::Matrix3d::Identity(), place}, simulation);
      const auto blobs = detect(frame.image.view(), options);
      ASSERT_EQ(blobs.size(), 1u);
      ASSERT_FALSE(blobs[0].rim.empty());
      nees.add(blobs[0], frame.lamps[0].image_centre_px, radius_px);  // parallel: a circle
    }
  }
  nees.expect_true(true);
}

/// Signal of a wall whose edge, left of the middle, has this width in pixels.
Canvas half_lit(double blur_px, double level_e) {
  Canvas canvas(width, height, 40);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      canvas.at(x, y) += level_e * 0.5 * std::erfc((x - 0.5 * width) / (blur_px * M_SQRT2));
  return canvas;
}

TEST(DetectLargeDiscs, ASmoothlyLitWallIsBackground) {
  Random random(5);
  EXPECT_TRUE(detect(half_lit(200, 1500).image({}, &random).view()).empty());
}

TEST(DetectLargeDiscs, LampsInFrontOfABrightWallAreDetected) {
  Random random(6);
  Canvas canvas = half_lit(1, 1500);
  const Eigen::Vector2d lamps[] = {{200.3, 250.8}, {420.7, 600.2}};
  for (const Eigen::Vector2d& lamp : lamps) canvas.add_disc(lamp, 12, 12, 0, 0.8, 2500);
  const auto blobs = detect(canvas.image({}, &random).view());
  for (const Eigen::Vector2d& lamp : lamps) {
    double nearest = 1e9;
    for (const Blob& blob : blobs) nearest = std::min(nearest, (blob.centroid_px - lamp).norm());
    EXPECT_LT(nearest, 0.1);
  }
}

}  // namespace
}  // namespace occ
