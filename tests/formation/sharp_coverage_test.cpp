// SPDX-License-Identifier: Apache-2.0
// Coverage without blur, compared with exact areas of circles and polygons in pixels.
#include "libocc/formation/internal/sharp_coverage.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/rim.hpp"
#include "tests/support/exact_area.hpp"
#include "tests/support/support.hpp"

namespace {

using namespace occ;
using namespace occ::internal::formation;
using namespace occ::test;

double value_at(const Patch& patch, int x, int y) {
  const bool inside =
      x >= patch.x0 && x < patch.x0 + patch.width && y >= patch.y0 && y < patch.y0 + patch.height;
  return inside ? patch.at(x, y) : 0;
}

Camera camera_at(const Eigen::Vector2d& centre, int width, int height) {
  return Camera::pinhole(width, height, 1000, 1000, centre.x(), centre.y());
}

CoverageMoments disc_image(const Eigen::Vector2d& centre, double radius, int width, int height) {
  return sharp_coverage(*project_chords(disc_lamp(0, {0, 0, 1}, radius / 1000), Rigid3{},
                                        camera_at(centre, width, height)),
                        width, height);
}

TEST(SharpCoverage, TheOracleIsTheAreaOfSimpleCases) {
  EXPECT_NEAR(disc_in_pixel({0, 0}, {0, 0}, 0.3), pi * 0.09, 1e-14);
  EXPECT_NEAR(disc_in_pixel({0, 0}, {0.5, 0.5}, 0.4), pi * 0.04, 1e-14);
  EXPECT_NEAR(disc_in_pixel({5, 0}, {0, 0}, 20), 1, 1e-12);
  EXPECT_NEAR(disc_in_pixel({25, 0}, {0, 0}, 20), 0, 1e-12);
  // At 0.9 the circle passes the pixel's corner; the value is from midpoint sums.
  double sum = 0;
  const int n = 2000;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      sum += std::hypot((i + 0.5) / n - 0.5 + 0.4, (j + 0.5) / n - 0.5 + 0.2) < 0.9;
  EXPECT_NEAR(disc_in_pixel({0, 0}, {-0.4, -0.2}, 0.9), sum / n / n, 1e-5);
}

TEST(SharpCoverage, DiscsMatchExactAreasInEveryPixel) {
  Random random(1);
  for (const double radius : {0.01, 0.2, 0.7, 3.0, 10.0, 31.7})
    for (int i = 0; i < 6; ++i) {
      // Also centres at which the rim touches the borders between pixels.
      Eigen::Vector2d centre(40 + random.uniform(), 35 + random.uniform());
      if (i == 0) centre = {40.5 + radius - std::floor(radius), 35};
      const CoverageMoments image = disc_image(centre, radius, 81, 71);
      double worst = 0;
      for (int y = 0; y < 71; ++y)
        for (int x = 0; x < 81; ++x)
          worst = std::max(worst, std::abs(value_at(image.c, x, y) -
                                           disc_in_pixel(Eigen::Vector2d(x, y), centre, radius)));
      EXPECT_LT(worst, 1e-7) << radius << ' ' << centre.transpose();
    }
}

TEST(SharpCoverage, MomentsBelongToThePartInThePixel) {
  const Eigen::Vector2d centre(20.3, 17.8);
  const double radius = 6.4;
  const CoverageMoments image = disc_image(centre, radius, 40, 36);
  for (int y = 0; y < 36; ++y)
    for (int x = 0; x < 40; ++x) {
      double m_x = 0, m_y = 0;
      const int n = 100;
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const Eigen::Vector2d in((i + 0.5) / n - 0.5, (j + 0.5) / n - 0.5);
          if ((Eigen::Vector2d(x, y) + in - centre).norm() > radius) continue;
          m_x += in.x() / n / n;
          m_y += in.y() / n / n;
        }
      EXPECT_NEAR(value_at(image.m_x, x, y), m_x, 4e-4) << x << ' ' << y;
      EXPECT_NEAR(value_at(image.m_y, x, y), m_y, 4e-4) << x << ' ' << y;
    }
}

TEST(SharpCoverage, ClippingToTheImageChangesNoPixel) {
  for (const Eigen::Vector2d& centre :
       {Eigen::Vector2d(-3, 10), {25, -4}, {52, 20}, {24, 43}, {24, 20}, {-30, 20}, {90, 20}}) {
    const CoverageMoments image = disc_image(centre, 30.3, 50, 40);
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 50; ++x)
        EXPECT_NEAR(value_at(image.c, x, y), disc_in_pixel(Eigen::Vector2d(x, y), centre, 30.3),
                    1e-7)
            << centre.transpose() << ", " << x << ' ' << y;
  }
  EXPECT_EQ(disc_image({200, 20}, 30, 50, 40).c.width, 0);
  for (const double value : disc_image({25, 20}, 400, 50, 40).c.values) EXPECT_NEAR(value, 1, 1e-9);
}

TEST(SharpCoverage, AnUprightRectangleIsAProductOfOverlaps) {
  Lamp lamp = disc_lamp(0, {0, 0, 1});
  lamp.shape = LampShape::rectangle;
  lamp.size_m = {0.0183, 0.0072};
  const Eigen::Vector2d centre(30.21, 20.83), half(9.15, 3.6);
  const CoverageMoments image =
      sharp_coverage(*project_chords(lamp, Rigid3{}, camera_at(centre, 64, 48)), 64, 48);
  const auto overlap = [](double pixel, double low, double high) {
    return std::max(0.0, std::min(pixel + 0.5, high) - std::max(pixel - 0.5, low));
  };
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      EXPECT_NEAR(value_at(image.c, x, y),
                  overlap(x, centre.x() - half.x(), centre.x() + half.x()) *
                      overlap(y, centre.y() - half.y(), centre.y() + half.y()),
                  1e-12);
}

// Area of the part of a convex polygon inside a pixel, by clipping (Sutherland and Hodgman, 1974).
double polygon_in_pixel(std::vector<Eigen::Vector2d> polygon, const Eigen::Vector2d& pixel) {
  for (int axis = 0; axis < 2; ++axis)
    for (const double side : {-1.0, 1.0}) {
      std::vector<Eigen::Vector2d> kept;
      const auto depth = [&](const Eigen::Vector2d& p) {
        return 0.5 - side * (p[axis] - pixel[axis]);
      };
      for (std::size_t i = 0; i < polygon.size(); ++i) {
        const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
        if (depth(a) >= 0) kept.push_back(a);
        if ((depth(a) >= 0) != (depth(b) >= 0))
          kept.push_back(a + depth(a) / (depth(a) - depth(b)) * (b - a));
      }
      polygon = kept;
    }
  double area = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i] - pixel, b = polygon[(i + 1) % polygon.size()] - pixel;
    area += 0.5 * (a.x() * b.y() - a.y() * b.x());
  }
  return std::abs(area);
}

TEST(SharpCoverage, WithDistortionMatchesPolygonsOfManySides) {
  const Camera bent = Camera::pinhole(80, 60, 70, 72, 40.3, 29.1, {-0.2, 0.05, 0.002, -0.003});
  const Rigid3 pose{so3_exp({0.3, -0.2, 0.5}), {0.1, 0.05, 0.1}};
  for (const LampShape shape : {LampShape::disc, LampShape::rectangle, LampShape::lame})
    for (const double exponent : {1.0, 3.3, 100.0}) {
      if (shape != LampShape::lame && exponent > 1) continue;
      Lamp lamp = disc_lamp(0, {0, 0, 1}, 0.12);
      lamp.shape = shape;
      lamp.size_m = {0.3, 0.17};
      lamp.exponent = exponent;
      lamp.validate();
      const CoverageMoments image = sharp_coverage(*project_chords(lamp, pose, bent), 80, 60);
      const std::vector<Eigen::Vector2d> rim =
          *project_rim(lamp, pose, bent, exponent < 100 ? 16000 : 50000);
      double worst = 0;
      for (int y = 10; y < 50; y += 3)
        for (int x = 20; x < 70; x += 2)
          worst = std::max(worst, std::abs(value_at(image.c, x, y) -
                                           polygon_in_pixel(rim, Eigen::Vector2d(x, y))));
      EXPECT_LT(worst, 1e-6) << static_cast<int>(shape) << ' ' << exponent;
    }
}

TEST(SharpCoverage, TheComparisonDetectsAMillionthOfAPixel) {
  const CoverageMoments image = disc_image({20.3 + 1e-5, 17.8}, 6.4, 40, 36);
  EXPECT_GT(std::abs(value_at(image.c, 27, 18) - disc_in_pixel({27, 18}, {20.3, 17.8}, 6.4)), 1e-6);
}

TEST(SharpCoverage, IsEmptyForADarkSideOrARimBehindTheCamera) {
  const Camera camera = test::vga_camera();
  EXPECT_FALSE(project_chords(disc_lamp(0, {0, 0, -1}), Rigid3{}, camera));
  Lamp upright = disc_lamp(0, {0.05, 0, 0.05}, 0.1);
  upright.normal = -Eigen::Vector3d::UnitX();
  EXPECT_FALSE(project_chords(upright, Rigid3{}, camera));
}

}  // namespace
