// SPDX-License-Identifier: Apache-2.0
// Lamps whose outline is neither an ellipse nor a convex polygon.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/detect/detect_support.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::Canvas;

constexpr double psf_px = 0.8;

DetectOptions any_form(const Sensor& sensor) {
  DetectOptions options;
  options.sensor = sensor;
  options.free_forms = true;
  return options;
}

/// Adds a lamp with straight sides between these corners.
void add_polygon(Canvas& canvas, const std::vector<Eigen::Vector2d>& corners, double level_e) {
  constexpr double spacing_px = 0.05;
  std::vector<Eigen::Vector2d> rim;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Eigen::Vector2d& from = corners[i];
    const Eigen::Vector2d along = corners[(i + 1) % corners.size()] - from;
    const int steps = static_cast<int>(along.norm() / spacing_px);
    for (int k = 0; k < steps; ++k) rim.push_back(from + along * k / steps);
  }
  canvas.add(rim, psf_px, level_e);
}

TEST(FreeForm, RimsOfLameCurvesAreUnbiasedWithTrueSigmas) {
  for (const double exponent : {1.3, 2.5, 4.0, 8.0}) {
    Scene scene;
    scene.camera = Camera::pinhole(640, 480, 420, 420, 319.5, 239.5, {-0.1, 0.02, 0, 0});
    Lamp lamp;
    lamp.shape = LampShape::lame;
    lamp.size_m = {0.6, 0.3};
    lamp.exponent = exponent;
    lamp.power_w = 9;
    scene.lamps = {lamp};
    scene.validate();
    double chi2 = 0, growth_px = 0;
    int points = 0, lamps = 0;
    Random random(17);
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
      Rigid3 pose;
      pose.rotation = so3_exp(Eigen::Vector3d(0, 0, random.uniform(-pi, pi))) *
                      so3_exp({random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), 0});
      pose.translation = {random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3), 2.2};
      SimulateOptions options;
      options.seed = seed;
      const Rendered rendered = simulate(scene, pose, options);
      const std::vector<Blob> blobs = detect(rendered.image.view(), any_form(scene.sensor));
      ASSERT_EQ(blobs.size(), 1u);
      const Blob& blob = blobs[0];
      ASSERT_FALSE(blob.saturated || blob.merged) << exponent;
      ASSERT_GT(blob.rim.size(), 60u) << exponent;
      EXPECT_TRUE(blob.free_form) << exponent;
      EXPECT_TRUE(blob.corners_px.empty());
      double sum = 0;
      for (const RimPoint& point : blob.rim) {
        const auto off_px = rim_distance_px(scene.lamps[0], rendered.cam_from_world,
                                            rim_ray(point, scene.camera).value());
        ASSERT_TRUE(off_px);
        chi2 += square(*off_px / point.sigma_px);
        sum += *off_px;
        EXPECT_LT(std::abs(*off_px), 6 * point.sigma_px) << exponent << " at " << point.px;
      }
      points += static_cast<int>(blob.rim.size());
      growth_px += sum / static_cast<double>(blob.rim.size());
      ++lamps;
      const Eigen::Vector2d error = blob.centroid_px - rendered.lamps[0].image_centre_px;
      EXPECT_LT(error.dot(blob.covariance_px2.inverse() * error), 16) << exponent;
      EXPECT_LT(error.norm(), 0.05) << exponent;  // the light is uneven by some percent
    }
    EXPECT_NEAR(chi2 / points, 1, 0.3) << exponent;
    EXPECT_LT(std::abs(growth_px / lamps), 1.5e-3) << exponent;
  }
}

TEST(FreeForm, OutlinesThatAreNotConvexAreMeasuredWithoutTheirCorners) {
  Canvas canvas(160, 120);
  const std::vector<Eigen::Vector2d> corners = {{30.3, 25.2}, {110.4, 35.1}, {106.1, 62.7},
                                                {62.8, 57.3}, {57.2, 96.4},  {22.6, 91.5}};
  add_polygon(canvas, corners, 3000);
  const Canvas::Noise noise;
  Random random(3);
  const std::vector<Blob> blobs =
      detect(canvas.image(noise, &random).view(), any_form(Canvas::sensor(noise, psf_px)));
  ASSERT_EQ(blobs.size(), 1u);
  const Blob& blob = blobs[0];
  EXPECT_TRUE(blob.free_form);
  EXPECT_TRUE(blob.merged);  // two lamps that touch may look like this
  DetectOptions with_hollows = any_form(Canvas::sensor(noise, psf_px));
  with_hollows.hollows = true;
  Random same(3);
  const std::vector<Blob> one = detect(canvas.image(noise, &same).view(), with_hollows);
  ASSERT_EQ(one.size(), 1u);
  EXPECT_FALSE(one[0].merged);
  EXPECT_EQ(one[0].centroid_px, blob.centroid_px);
  ASSERT_GT(blob.rim.size(), 120u);
  double chi2 = 0;
  for (const RimPoint& point : blob.rim) {
    double nearest = infinity;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Eigen::Vector2d along = corners[(i + 1) % corners.size()] - corners[i];
      const Eigen::Vector2d normal = Eigen::Vector2d(along.y(), -along.x()).normalized();
      if (normal.dot(point.normal) < 0.99) continue;
      const double off = normal.dot(point.px - corners[i]);
      if (std::abs(off) < std::abs(nearest)) nearest = off;
    }
    chi2 += square(nearest / point.sigma_px);
  }
  EXPECT_NEAR(chi2 / static_cast<double>(blob.rim.size()), 1, 0.4);
}

TEST(FreeForm, ClippedLampsHaveGrownEvenly) {
  Canvas canvas(160, 120);
  std::vector<Eigen::Vector2d> rim;  // a Lame curve of exponent 4
  for (int i = 0; i < 2000; ++i) {
    const double t = 2 * pi * i / 2000, c = std::cos(t), s = std::sin(t);
    const double r = std::pow(std::pow(c, 4) + std::pow(s, 4), -0.25);
    rim.emplace_back(80.3 + 45 * r * c, 60.2 + 25 * r * s);
  }
  canvas.add(rim, psf_px, 20000);
  const Canvas::Noise noise;
  Random random(3);
  const std::vector<Blob> blobs =
      detect(canvas.image(noise, &random).view(), any_form(Canvas::sensor(noise, psf_px)));
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_TRUE(blobs[0].saturated && blobs[0].free_form && !blobs[0].merged);
  EXPECT_LT((blobs[0].centroid_px - Eigen::Vector2d(80.3, 60.2)).norm(), 0.05);
  std::vector<double> growths_px;
  for (const RimPoint& point : blobs[0].rim) {
    const Eigen::Vector2d from_centre = point.px - Eigen::Vector2d(80.3, 60.2);
    const double u = std::abs(from_centre.x() / 45), v = std::abs(from_centre.y() / 25);
    const double gauge = std::pow(std::pow(u, 4) + std::pow(v, 4), 0.25);
    growths_px.push_back((1 - 1 / gauge) * from_centre.dot(point.normal));
  }
  ASSERT_GT(growths_px.size(), 100u);
  const auto [least, most] = std::minmax_element(growths_px.begin(), growths_px.end());
  EXPECT_GT(*least, 0.5);
  EXPECT_LT(*most - *least, 0.3);
}

TEST(FreeForm, LampsThatTouchAreMerged) {
  Canvas canvas(160, 120);
  canvas.add_disc({60, 60}, 20, 20, 0, psf_px, 3000);
  canvas.add_disc({97, 60}, 20, 20, 0, psf_px, 3000);
  const Canvas::Noise noise;
  Random random(3);
  const std::vector<Blob> blobs =
      detect(canvas.image(noise, &random).view(), any_form(Canvas::sensor(noise, psf_px)));
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_TRUE(blobs[0].merged);
  EXPECT_GT(blobs[0].covariance_px2.trace(), 100);
}

TEST(FreeForm, EllipsesAndRectanglesStayWhatTheyAre) {
  Canvas canvas(200, 120);
  canvas.add_disc({50, 60}, 30, 20, 0.3, psf_px, 3000);
  add_polygon(canvas, {{110, 30}, {180, 38}, {176, 88}, {106, 80}}, 3000);
  const Canvas::Noise noise;
  Random random(3);
  const Image image = canvas.image(noise, &random);
  const Sensor sensor = Canvas::sensor(noise, psf_px);
  DetectOptions without = any_form(sensor);
  without.free_forms = false;
  const std::vector<Blob> blobs = detect(image.view(), any_form(sensor));
  const std::vector<Blob> same = detect(image.view(), without);
  ASSERT_EQ(blobs.size(), 2u);
  ASSERT_EQ(same.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_FALSE(blobs[i].free_form);
    ASSERT_EQ(blobs[i].rim.size(), same[i].rim.size());
    EXPECT_EQ(blobs[i].rim[0].px, same[i].rim[0].px);
  }
}

}  // namespace
}  // namespace occ
