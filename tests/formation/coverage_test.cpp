// SPDX-License-Identifier: Apache-2.0
// Coverage, compared with quadrature over the shape's *area* (the library integrates along its
// rim).
#include "libocc/formation/coverage.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "tests/support/quadrature.hpp"
#include "tests/support/support.hpp"

namespace {

using namespace occ;
using namespace occ::test;

// Coverage of the pixel at `offset` from a disc's centre, in polar coordinates about the centre.
// Only the part within the pixel's reach is integrated.
double disc_pixel(const Eigen::Vector2d& offset, double radius, double sigma) {
  const double distance = offset.norm(), reach = 1 + 7 * sigma;
  const double bearing = std::atan2(offset.y(), offset.x());
  const double half_angle =
      distance > 1.5 * reach ? std::min(pi, 1.05 * std::asin(reach / distance)) : pi;
  const auto ring = [&](double r) {
    const auto light = [&](double angle) {
      return box_blurred(offset.x() - r * std::cos(angle), sigma) *
             box_blurred(offset.y() - r * std::sin(angle), sigma);
    };
    return r * integrate(light, bearing - half_angle, bearing + half_angle,
                         0.7 * sigma / std::max(r, sigma));
  };
  const double from = std::max(0.0, distance - reach), to = std::min(radius, distance + reach);
  return from < to ? integrate(ring, from, to, 0.7 * sigma) : 0;
}

Contour disc_contour(const Eigen::Vector2d& centre, double radius, double spacing) {
  const Camera camera = Camera::pinhole(701, 701, 1000, 1000, centre.x(), centre.y());
  return *project_contour(test::disc_lamp(0, {0, 0, 1}, radius / 1000), Rigid3{}, camera, spacing);
}

double value_at(const Patch& patch, int x, int y) {
  const bool inside =
      x >= patch.x0 && x < patch.x0 + patch.width && y >= patch.y0 && y < patch.y0 + patch.height;
  return inside ? patch.at(x, y) : 0;
}

double sum(const Patch& patch) {
  double total = 0;
  for (const double value : patch.values) total += value;
  return total;
}

// Largest error over pixels at, inside and outside the rim.
double worst_disc_error(const Patch& patch, const Eigen::Vector2d& centre, double radius,
                        double sigma) {
  double worst = 0;
  for (int i = 0; i < 36; ++i) {
    const double from_centre = std::max(0.0, radius + (i % 9 - 4) * sigma);
    const double angle = 2.4 * i;
    const int x = static_cast<int>(std::lround(centre.x() + from_centre * std::cos(angle)));
    const int y = static_cast<int>(std::lround(centre.y() + from_centre * std::sin(angle)));
    const double truth = disc_pixel(Eigen::Vector2d(x, y) - centre, radius, sigma);
    worst = std::max(worst, std::abs(value_at(patch, x, y) - truth));
  }
  return worst;
}

TEST(Coverage, DiscsOfAnySizeAndBlurMatchAreaQuadrature) {
  const Eigen::Vector2d centre(350.13, 349.71);
  for (const double sigma : {0.2, 0.5, 0.8, 5.0}) {
    const PixelPsf psf(sigma);
    for (const double radius : {0.05, 1.0, 24.0, 300.0}) {
      const Patch patch = coverage(disc_contour(centre, radius, sigma), psf, 701, 701);
      const double peak = std::min(1.0, pi * radius * radius);
      EXPECT_LT(worst_disc_error(patch, centre, radius, sigma), 1e-6 * peak)
          << "radius " << radius << ", sigma " << sigma;
    }
  }
}

TEST(Coverage, TheComparisonDetectsAThousandthOfAPixel) {
  const Eigen::Vector2d centre(40.2, 40.7), moved(40.201, 40.7);
  const Patch patch = coverage(disc_contour(moved, 12, 0.8), PixelPsf(0.8), 80, 80);
  EXPECT_GT(worst_disc_error(patch, centre, 12, 0.8), 1e-4);
}

TEST(Coverage, SpacingSetsTheAccuracy) {
  const Eigen::Vector2d centre(40.2, 40.7);
  std::vector<double> errors;
  for (const double spacing : {2.0, 1.5, 1.0})
    errors.push_back(worst_disc_error(
        coverage(disc_contour(centre, 24, spacing * 0.8), PixelPsf(0.8), 80, 80), centre, 24, 0.8));
  EXPECT_GT(errors[0], 10 * errors[1]);
  EXPECT_GT(errors[1], 10 * errors[2]);
}

TEST(Coverage, FluxIsTheAreaOfTheShape) {
  for (const double radius : {0.05, 0.7, 24.0})
    EXPECT_NEAR(sum(coverage(disc_contour({60.3, 59.8}, radius, 0.8), PixelPsf(0.8), 121, 121)) /
                    (pi * radius * radius),
                1, 1e-7);
}

TEST(Coverage, SamplesOfASmoothCurveGiveTheSameAsTangents) {
  const Contour exact = disc_contour({40.2, 40.7}, 24, 0.8);
  std::vector<Eigen::Vector2d> rim, reversed;
  for (const ContourPoint& point : exact) rim.push_back(point.px);
  reversed.assign(rim.rbegin(), rim.rend());
  const Patch truth = coverage(exact, PixelPsf(0.8), 80, 80);
  for (const auto& samples : {rim, reversed}) {
    const Patch patch = coverage(samples, 0.8, 80, 80);
    ASSERT_EQ(patch.values.size(), truth.values.size());
    for (std::size_t i = 0; i < truth.values.size(); ++i)
      EXPECT_NEAR(patch.values[i], truth.values[i], 1e-12);
  }
  EXPECT_THROW(coverage(std::vector<Eigen::Vector2d>(12), 0.8, 80, 80), std::invalid_argument);
}

TEST(Coverage, ClippingToTheImageChangesNoPixel) {
  const PixelPsf psf(0.9);
  const Contour big = disc_contour({30, 25}, 40, 0.9);
  Contour shifted = big;  // the same contour in the middle of a larger image
  for (ContourPoint& point : shifted) point.px += Eigen::Vector2d(100, 100);
  const Patch clipped = coverage(big, psf, 50, 40), whole = coverage(shifted, psf, 300, 300);
  EXPECT_EQ(clipped.width, 50);
  EXPECT_EQ(clipped.height, 40);
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 50; ++x)
      EXPECT_NEAR(clipped.at(x, y), whole.at(x + 100, y + 100), 1e-8) << x << ' ' << y;
}

TEST(Coverage, ShapesOutsideAreEmptyAndShapesAllAroundAreOne) {
  const PixelPsf psf(0.8);
  for (const Eigen::Vector2d& centre :
       {Eigen::Vector2d(-60, 20), {110, 20}, {25, -60}, {25, 90}, {1e12, 1e12}})
    EXPECT_EQ(coverage(disc_contour(centre, 40, 0.8), psf, 50, 40).width, 0) << centre;
  const Patch full = coverage(disc_contour({25, 20}, 200, 0.8), psf, 50, 40);
  ASSERT_EQ(full.values.size(), 50u * 40u);
  for (const double value : full.values) EXPECT_NEAR(value, 1, 1e-7);
  EXPECT_EQ(coverage(Contour(), psf, 50, 40).width, 0);
}

Lamp rectangle(const Eigen::Vector2d& size_m) {
  Lamp lamp;
  lamp.shape = LampShape::rectangle;
  lamp.size_m = size_m;
  lamp.centre_m = {0, 0, 1};
  return lamp;
}

double integral(double u, double sigma) {  // of the Gaussian convolved with the box, by quadrature
  return integrate([&](double v) { return box_blurred(v, sigma); }, -9 * sigma - 1, u, 0.5 * sigma);
}

TEST(Coverage, UprightRectangleMatchesItsClosedForm) {
  // Separable: the product of two one-dimensional coverages.
  const double sigma = 0.7, half_x = 9.3, half_y = 3.2, cx = 30.4, cy = 20.9;
  const Camera camera = Camera::pinhole(64, 48, 100, 100, cx, cy);
  const Lamp lamp = rectangle({2 * half_x / 100, 2 * half_y / 100});
  const Patch patch =
      coverage(*project_contour(lamp, Rigid3{}, camera, sigma), PixelPsf(sigma), 64, 48);
  for (int y = 12; y < 30; ++y)
    for (int x = 15; x < 46; ++x) {
      const double across = integral(x - cx + half_x, sigma) - integral(x - cx - half_x, sigma);
      const double down = integral(y - cy + half_y, sigma) - integral(y - cy - half_y, sigma);
      EXPECT_NEAR(value_at(patch, x, y), across * down, 1e-6) << x << ' ' << y;
    }
}

TEST(Coverage, ARimFarLargerThanTheImageIsAHalfPlane) {
  // The right end of a disc of 500000 px crosses the image; the sagitta of the rim is 1e-3 px.
  const double sigma = 0.8, end_x = 31.3;
  for (const double tilt :
       {0.0, 1.5, 3.0}) {  // the start of the rim is inside or outside the image
    Lamp lamp = test::disc_lamp(0, {0, 0, 2}, 1);
    lamp.normal = Eigen::Vector3d(0, 0, -1);
    const Camera camera = Camera::pinhole(64, 48, 1e6, 1e6, end_x - 5e5, 23.5);
    const Rigid3 spun{so3_exp({0, 0, tilt}), Eigen::Vector3d::Zero()};
    const auto contour = project_contour(lamp, spun, camera, sigma);
    ASSERT_TRUE(contour);
    EXPECT_LT(contour->size(), 3000u);
    const Patch patch = coverage(*contour, PixelPsf(sigma), 64, 48);
    for (int x = 0; x < 64; ++x)
      for (const int y : {0, 23, 47}) {
        const double sagitta = (y - 23.5) * (y - 23.5) / 1e6;
        EXPECT_NEAR(value_at(patch, x, y), 1 - integral(x - end_x + sagitta, sigma), 2e-6)
            << x << ' ' << y;
      }
  }
}

TEST(Coverage, TiltedRectangleBehindALensMatchesQuadratureOverTheLamp) {
  const Camera camera = Camera::pinhole(80, 60, 70, 72, 40.3, 29.1, {-0.2, 0.05, 0.002, -0.003});
  const Rigid3 pose{so3_exp({0.3, -0.2, 0.5}), {0.1, 0.05, 0.1}};
  const double sigma = 0.8;
  const Lamp lamp = rectangle({0.21, 0.13});
  const Patch patch =
      coverage(*project_contour(lamp, pose, camera, sigma), PixelPsf(sigma), 80, 60);

  // Each element of the lamp is a point of light at its own projection.
  Eigen::Matrix<double, 3, 2> sides;
  sides << lamp.size_m.x(), 0, 0, lamp.size_m.y(), 0, 0;
  sides = pose.rotation * sides;
  Eigen::MatrixXd truth = Eigen::MatrixXd::Zero(80, 60);
  for (const Eigen::Vector2d& u : quadrature(20))
    for (const Eigen::Vector2d& v : quadrature(14)) {
      const Eigen::Vector3d at = pose * lamp.centre_m + sides * Eigen::Vector2d(u.x(), v.x());
      Eigen::Matrix<double, 2, 3> jacobian;
      const Eigen::Vector2d px = *camera.project(at, &jacobian);
      const double area = u.y() * v.y() * std::abs((jacobian * sides).determinant());
      add_dot(truth, px, sigma, area);
    }
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) EXPECT_NEAR(value_at(patch, x, y), truth(x, y), 2e-6);
}

TEST(Contour, IsEmptyForADarkSideOrARimBehindTheCamera) {
  const Camera camera = test::vga_camera();
  const Rigid3 from_above{so3_exp({pi, 0, 0}), {0, 0, 4}};  // looks down at the lamp's back
  EXPECT_FALSE(project_contour(test::disc_lamp(0, {0, 0, 1}), from_above, camera, 0.8));
  EXPECT_FALSE(project_contour(test::disc_lamp(0, {0, 0, -1}), Rigid3{}, camera, 0.8));
  Lamp upright = test::disc_lamp(0, {0.05, 0, 0.05}, 0.1);
  upright.normal = -Eigen::Vector3d::UnitX();
  EXPECT_FALSE(project_contour(upright, Rigid3{}, camera, 0.8));
  EXPECT_TRUE(project_contour(test::disc_lamp(0, {0, 0, 1}), Rigid3{}, camera, 0.8));
  for (const double bad : {0.0, -1.0, std::nan("")})
    EXPECT_THROW(project_contour(upright, Rigid3{}, camera, bad), std::invalid_argument);
}

TEST(PointCoverage, IsThePsfOverEachPixelAndSumsToOne) {
  for (const double sigma : {0.2, 0.8, 3.0})
    for (const Eigen::Vector2d& px :
         {Eigen::Vector2d(30.0, 20.0), {31.49, 19.51}, {30.999, 20.1}}) {
      const Patch patch = point_coverage(px, sigma, 64, 48);
      EXPECT_NEAR(sum(patch), 1, 1e-12);
      for (int y = patch.y0; y < patch.y0 + patch.height; ++y)
        for (int x = patch.x0; x < patch.x0 + patch.width; ++x)
          EXPECT_NEAR(patch.at(x, y),
                      box_blurred(x - px.x(), sigma) * box_blurred(y - px.y(), sigma), 1e-6);
    }
}

TEST(PointCoverage, IsClippedAtTheBorder) {
  const Patch corner = point_coverage({-0.5, -0.5}, 0.8, 64, 48);
  EXPECT_NEAR(sum(corner), 0.25, 1e-6);
  EXPECT_EQ(point_coverage({-8, 10}, 0.8, 64, 48).width, 0);
  EXPECT_EQ(point_coverage({1e15, 10}, 0.8, 64, 48).width, 0);
}

TEST(PixelPsf, RejectsASigmaOutsideItsRange) {
  for (const double bad : {0.0, -1.0, 1e3, std::nan("")})
    EXPECT_THROW(PixelPsf{bad}, std::invalid_argument);
}

}  // namespace
