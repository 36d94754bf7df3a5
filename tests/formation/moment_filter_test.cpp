// SPDX-License-Identifier: Apache-2.0
// Moments computed from coverage by a filter, compared with moments painted along the rim.
#include "libocc/formation/moment_filter.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/formation/coverage.hpp"
#include "tests/support/support.hpp"

namespace {

using namespace occ;

Contour disc_contour(const Eigen::Vector2d& centre, double radius, double sigma) {
  const Camera camera = Camera::pinhole(100, 80, 1000, 1000, centre.x(), centre.y());
  return *project_contour(test::disc_lamp(0, {0, 0, 1}, radius / 1000), Rigid3{}, camera, sigma);
}

// Largest error of both moments, relative to the largest moment.
double worst_error(const Eigen::Vector2d& centre, double radius, double sigma,
                   const MomentFilter& filter) {
  const PixelPsf psf(sigma);
  const Contour contour = disc_contour(centre, radius, sigma);
  const CoverageMoments painted = coverage_moments(contour, psf, 100, 80);
  CoveragePainter painter;
  const CoverageRows rows = painter.paint(contour, psf, 100, 80);
  EXPECT_EQ(rows.x0, painted.c.x0);
  EXPECT_EQ(rows.y0, painted.c.y0);
  EXPECT_EQ(rows.width, painted.c.width);
  EXPECT_EQ(rows.height, painted.c.height);
  double worst = 0, most = 0;
  for (int y = 0; y < rows.height; ++y)
    for (int x = 0; x < rows.width; ++x) {
      const float* c = rows.first + y * rows.stride + x;
      double m_x = 0, m_y = 0;
      for (std::ptrdiff_t j = 1; j <= 4; ++j) {
        const double tap = filter.taps()[j - 1];
        m_x += tap * (c[j] - c[-j]);
        m_y += tap * (c[j * rows.stride] - c[-j * rows.stride]);
      }
      const double p_x = painted.m_x.at(rows.x0 + x, rows.y0 + y);
      const double p_y = painted.m_y.at(rows.x0 + x, rows.y0 + y);
      worst = std::max({worst, std::abs(m_x - p_x), std::abs(m_y - p_y)});
      most = std::max({most, std::abs(p_x), std::abs(p_y)});
    }
  return worst / most;
}

// If light changes by 1/500 per pixel, an image contains 1/500 of the moments, so its error is
// below 1/500 of the errors here.
TEST(MomentFilter, AgreesWithPaintedMoments) {
  const Eigen::Vector2d centre(50.2, 40.7);
  for (const auto& [sigma, bound] :
       {std::pair<double, double>{1.4, 1e-3}, {1.5, 5e-4}, {2, 7e-5}, {3, 5e-6}, {6, 2e-5}})
    for (const double radius : {3.0, 10.0, 25.0})
      EXPECT_LT(worst_error(centre, radius, sigma, MomentFilter(sigma)), bound)
          << "sigma " << sigma << ", radius " << radius;
}

TEST(MomentFilter, IsCorrectAtTheBorderOfTheImage) {
  for (const Eigen::Vector2d& centre :
       {Eigen::Vector2d(1, 40), {98, 41}, {50, -2}, {49, 80}, {-3, -4}, {103, 82}})
    EXPECT_LT(worst_error(centre, 20, 1.5, MomentFilter(1.5)), 5e-4) << centre.transpose();
}

TEST(MomentFilter, TheComparisonDetectsTheFilterOfAnotherPsf) {
  EXPECT_GT(worst_error({50, 40}, 10, 1.5, MomentFilter(1.51)), 5e-3);
}

TEST(MomentFilter, IsNotUsedIfPixelsDoNotResolveThePsf) {
  EXPECT_FALSE(MomentFilter::resolves(1));
  EXPECT_TRUE(MomentFilter::resolves(1.5));
  EXPECT_GT(worst_error({50.2, 40.7}, 10, 1, MomentFilter(1)), 2e-3);
}

}  // namespace
