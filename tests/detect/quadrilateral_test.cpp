// SPDX-License-Identifier: Apache-2.0
// Rectangular lamps: their outline is no ellipse, but they are single lamps.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/detect/detect.hpp"
#include "tests/detect/detect_support.hpp"

namespace occ {
namespace {

using Eigen::Vector2d;
using test::Canvas;

/// A rectangle whose light is `level(u)` at the part u, in [-1, 1], of its length.
template <typename Level>
void add_rectangle(Canvas& canvas, int width, const Vector2d& centre, const Vector2d& size,
                   double angle_rad, Level&& level) {
  constexpr int strips = 24;
  const Vector2d along(std::cos(angle_rad), std::sin(angle_rad)), across(-along.y(), along.x());
  for (int i = 0; i < strips; ++i) {
    const double from = -1 + 2.0 * i / strips, to = from + 2.0 / strips;
    std::vector<Vector2d> rim;
    const auto add_edge = [&](const Vector2d& a, const Vector2d& b) {
      for (int k = 0; k < 32; ++k) rim.push_back(a + k / 32.0 * (b - a));
    };
    const auto corner = [&](double u, double v) -> Vector2d {
      return centre + 0.5 * (u * size.x() * along + v * size.y() * across);
    };
    add_edge(corner(from, -1), corner(to, -1));
    add_edge(corner(to, -1), corner(to, 1));
    add_edge(corner(to, 1), corner(from, 1));
    add_edge(corner(from, 1), corner(from, -1));
    const auto patch = coverage(rim, 0.8, width, canvas.height());
    for (int y = patch.y0; y < patch.y0 + patch.height; ++y)
      for (int x = patch.x0; x < patch.x0 + patch.width; ++x)
        canvas.at(x, y) += level(0.5 * (from + to)) * patch.at(x, y);
  }
}

std::vector<Blob> found_in(const Canvas& canvas) {
  DetectOptions options;
  options.sensor = Canvas::sensor({}, 0.8);
  Random random(1);
  return detect(canvas.image({}, &random).view(), options);
}

TEST(Quadrilateral, ARectangleIsOneLamp) {
  for (const double angle_rad : {0.0, 0.1, 0.5, 0.785, 1.4})
    for (const Vector2d& size : {Vector2d(31, 12), Vector2d(60, 14), Vector2d(20, 20)}) {
      Canvas canvas(120, 110);
      const Vector2d centre(60.3, 54.6);
      add_rectangle(canvas, 120, centre, size, angle_rad, [](double) { return 3000; });
      const std::vector<Blob> blobs = found_in(canvas);
      ASSERT_EQ(blobs.size(), 1u);
      EXPECT_FALSE(blobs[0].merged) << size.transpose() << ", " << angle_rad;
      EXPECT_LT((blobs[0].centroid_px - centre).norm(), 0.1);
      EXPECT_LT(blobs[0].covariance_px2.trace(), 1);
    }
}

// The covariance contains the difference between the centres of light and face.
TEST(Quadrilateral, UnevenLightIsAllowedFor) {
  Canvas canvas(120, 110);
  const Vector2d centre(60, 55);
  add_rectangle(canvas, 120, centre, {32, 12}, 0.4, [](double u) { return 1600 * (1.1 + u); });
  const std::vector<Blob> blobs = found_in(canvas);
  ASSERT_EQ(blobs.size(), 1u);
  EXPECT_FALSE(blobs[0].merged);
  const Vector2d off = blobs[0].centroid_px - centre;
  EXPECT_LT(off.norm(), 3);  // that of the light is 4.8 px off
  EXPECT_LT(off.dot(blobs[0].covariance_px2.inverse() * off), 9);
}

TEST(Quadrilateral, TwoRectanglesAreMerged) {
  Canvas canvas(120, 110);
  for (const double x : {40, 73})
    add_rectangle(canvas, 120, {x, 55}, {29, 12}, 0, [](double) { return 4000; });
  const std::vector<Blob> blobs = found_in(canvas);
  for (const Blob& blob : blobs) EXPECT_TRUE(blob.merged || blobs.size() == 2);
}

TEST(Quadrilateral, OverlappingDiscsAreMerged) {
  for (const double apart_px : {15, 18, 20, 22}) {
    Canvas canvas(120, 110);
    canvas.add_disc({50, 55}, 10, 10, 0, 0.8, 3000);
    canvas.add_disc({50 + apart_px, 55}, 10, 10, 0, 0.8, 3000);
    for (const Blob& blob : found_in(canvas)) EXPECT_TRUE(blob.merged) << apart_px;
  }
}

/// Distance of the farthest of four corners from the nearest measured one.
double farthest_corner_px(const std::vector<Vector2d>& measured, const Vector2d& centre,
                          const Vector2d& size, double angle_rad) {
  const Vector2d along(std::cos(angle_rad), std::sin(angle_rad)), across(-along.y(), along.x());
  double farthest = 0;
  for (const double u : {-0.5, 0.5})
    for (const double v : {-0.5, 0.5}) {
      const Vector2d corner = centre + u * size.x() * along + v * size.y() * across;
      double nearest = 1e9;
      for (const Vector2d& px : measured) nearest = std::min(nearest, (px - corner).norm());
      farthest = std::max(farthest, nearest);
    }
  return farthest;
}

// Light that differs from block to block, and lowers the sides here and there.
TEST(Quadrilateral, CornersOfBlotchyLightAreMeasured) {
  constexpr int block_px = 3;
  const Vector2d centre(60.3, 54.6);
  int rough = 0;
  for (const double angle_rad : {0.1, 0.3, 1.1, 2.0})
    for (const Vector2d& size : {Vector2d(50, 14), Vector2d(56, 24)}) {
      Canvas canvas(120, 110);
      add_rectangle(canvas, 120, centre, size, angle_rad, [](double) { return 3000; });
      Random random(7);
      for (int y = 0; y < 110; y += block_px)
        for (int x = 0; x < 120; x += block_px) {
          const double factor = random.uniform(0.5, 1.3);
          for (int v = y; v < std::min(110, y + block_px); ++v)
            for (int u = x; u < std::min(120, x + block_px); ++u) canvas.at(u, v) *= factor;
        }
      const std::vector<Blob> blobs = found_in(canvas);
      ASSERT_EQ(blobs.size(), 1u);
      ASSERT_EQ(blobs[0].corners_px.size(), 4u) << size.transpose() << ", " << angle_rad;
      EXPECT_LT(farthest_corner_px(blobs[0].corners_px, centre, size, angle_rad), 1.5);
      const Vector2d off = blobs[0].centroid_px - centre;
      EXPECT_LT(off.dot(blobs[0].covariance_px2.inverse() * off), 9)
          << size.transpose() << ", " << angle_rad;
      EXPECT_GT(blobs[0].rim.size(), 20u);
      rough += blobs[0].rim_covariance_px2(0, 0) > 0.5;
    }
  EXPECT_GE(rough, 2);  // the others have sharp sides
}

}  // namespace
}  // namespace occ
