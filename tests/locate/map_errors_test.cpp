// SPDX-License-Identifier: Apache-2.0
// Views of a room whose map has errors. The image cuts some lamps at its border: their arcs alone
// determine neither place nor size.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

struct Tally {
  int ok = 0, not_converged = 0, wrong = 0;
  double nees = 0;  ///< sum of the normalised squared errors of the positions
  std::string failed;
};

/// Random views from below the ceiling; views of fewer than three lamps are left out.
Tally locate_views(double map_sigma_m, bool stated, int views) {
  const Scene map = test::irregular_room();
  constexpr double three_sigma = 14.16;  // quantile of chi-square with 3 degrees of freedom
  Tally tally;
  for (int view = 0; view < views; ++view) {
    Random random(static_cast<std::uint64_t>(view), 7);
    const Eigen::Vector3d at(random.uniform(1, 3), random.uniform(1, 3), random.uniform(0.2, 0.8));
    const Eigen::Vector3d aside(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), 2.2);
    const double turn = random.uniform(0, 2 * pi);
    const Rigid3 pose = look_at(at, at + aside, {std::cos(turn), std::sin(turn), 0});
    Scene real = map;
    for (Lamp& lamp : real.lamps)
      for (int k = 0; k < 3; ++k) lamp.centre_m[k] += map_sigma_m * random.normal();
    Scene believed = map;
    if (stated) believed.map_sigma_m = map_sigma_m;
    const Result<Fix> fix = locate(simulate(real, pose).image.view(), believed);
    if (fix.status == Status::not_converged) {
      ++tally.not_converged;
      tally.failed += std::to_string(view) + " ";
    }
    if (!fix.ok()) continue;
    ++tally.ok;
    const double nees = test::nees(fix->position_m - at, fix->position_covariance_m2);
    tally.nees += nees;
    if (nees < three_sigma) continue;
    ++tally.wrong;
    tally.failed += std::to_string(view) + " ";
  }
  return tally;
}

void expect_found(int views) {
  const Tally tally = locate_views(0.01, true, views);
  EXPECT_LE(tally.not_converged, views / 60) << tally.failed;
  EXPECT_GE(tally.ok, views * 9 / 10);
  const auto [low, high] = test::chi2_interval(3.0 * tally.ok);
  EXPECT_GT(tally.nees, low);
  EXPECT_LT(tally.nees, high);
}

TEST(MapErrors, LampsCutByTheBorderAreUsedWhereTheErrorsAreStated) { expect_found(180); }

TEST(SlowMapErrors, LampsCutByTheBorderAreUsedWhereTheErrorsAreStated) { expect_found(2000); }

// Errors of a few sigma of the rims. Three lamps seldom contradict each other.
TEST(MapErrors, UnstatedOnesEnlargeTheCovarianceOfFewLamps) {
  constexpr int views = 300;
  EXPECT_LE(locate_views(1e-3, false, views).wrong, views / 100);
  const Tally small = locate_views(5e-4, false, views);
  EXPECT_LE(small.wrong, 5) << small.failed;
  EXPECT_GT(small.ok, views * 9 / 10);
}

}  // namespace
}  // namespace occ
