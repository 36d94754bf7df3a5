// SPDX-License-Identifier: Apache-2.0
// Ring lamps: discs with a dark middle. Their outer rim is measured; its size is uncertain if the
// lit part is narrower than the profile of an edge.
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/detect/detect.hpp"
#include "tests/detect/detect_support.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

using test::Canvas;

constexpr double psf_px = 0.8, level_e = 4000;

struct Rings {
  double centre = 0, radius = 0;  // sums of normalised squared errors
  double centre_px2 = 0;          // sum of squared errors
  int measured = 0, other = 0;    // with and without a rim

  void expect_true() const {
    EXPECT_LT(centre, test::chi2_interval(2.0 * measured).second);
    EXPECT_GT(centre, test::chi2_interval(2.0 * measured).first);
    EXPECT_LT(radius, test::chi2_interval(measured).second);
  }
};

/// `count` circular rings of random place and radius whose lit part is `lit` of the radius.
/// `middle`: level in the hole, relative to the lit part.
Rings measure_rings(int count, double lit, double middle) {
  Rings rings;
  Random random(5);
  for (int i = 0; i < count; ++i) {
    const double radius_px = 15 + 35 * random.uniform();
    const Eigen::Vector2d centre(80 + random.uniform(), 80 + random.uniform());
    Canvas canvas(160, 160);
    canvas.add_disc(centre, radius_px, radius_px, 0, psf_px, level_e);
    const double hole_px = (1 - lit) * radius_px;
    canvas.add_disc(centre, hole_px, hole_px, 0, psf_px, (middle - 1) * level_e);
    const std::vector<Blob> blobs = detect(canvas.image({}, &random).view());
    EXPECT_EQ(blobs.size(), 1U);
    if (blobs.size() != 1) continue;
    const Blob& blob = blobs[0];
    if (blob.rim.empty()) {
      ++rings.other;
      continue;
    }
    ++rings.measured;
    const Eigen::Vector2d error_px = blob.centroid_px - centre;
    rings.centre += test::nees(error_px, blob.covariance_px2);
    rings.centre_px2 += error_px.squaredNorm();
    double weights = 0, sum = 0;
    for (const RimPoint& point : blob.rim) {
      const double weight = 1 / square(point.sigma_px);
      weights += weight;
      sum += weight * ((point.px - centre).norm() - radius_px);
    }
    rings.radius += square(sum / weights) / (1 / weights + blob.rim_covariance_px2(0, 0));
  }
  return rings;
}

TEST(RingLamps, TheOuterRimIsMeasured) {
  for (const double lit : {0.5, 0.7, 0.9})
    for (const double middle : {0.0, 0.2}) {
      SCOPED_TRACE(testing::Message() << lit << " lit, middle " << middle);
      const Rings rings = measure_rings(40, lit, middle);
      EXPECT_EQ(rings.measured, 40);
      rings.expect_true();
    }
}

/// The tail of its edge is not quite the model's; the covariance allows for that.
TEST(RingLamps, ANarrowRingHasARimOfUncertainSize) {
  for (const double lit : {0.08, 0.15, 0.25}) {
    SCOPED_TRACE(testing::Message() << lit << " lit");
    const Rings rings = measure_rings(60, lit, 0);
    EXPECT_EQ(rings.other, 0);
    EXPECT_LT(rings.centre, test::chi2_interval(2.0 * rings.measured).second);
    EXPECT_LT(rings.radius, test::chi2_interval(rings.measured).second);
    EXPECT_LT(std::sqrt(rings.centre_px2 / rings.measured), 0.005);
  }
}

}  // namespace
}  // namespace occ
