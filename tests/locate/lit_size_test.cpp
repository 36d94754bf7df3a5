// SPDX-License-Identifier: Apache-2.0
// Lamps whose lit part is smaller or larger than the radius in the map, as of a map of housings.
// The directions alone determine the pose.
#include <gtest/gtest.h>

#include <cmath>

#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Scene room_of_six() {
  Lamp lamp;
  lamp.radius_m = 0.12;
  lamp.power_w = 4;
  return test::ceiling_of({{1, 1.1}, {2.9, 1.2}, {1.2, 2.8}, {2.6, 2.7}, {1.9, 1.7}, {3.1, 2.1}}, 3,
                          lamp);
}

struct Verdicts {
  int images = 0, ok = 0, wrong = 0;
  double worst_m = 0;     ///< largest error of a fix that is ok
  double size_sigma = 0;  ///< largest estimated one
  int advised = 0;        ///< messages that say by what factor the sizes are off
};

/// Images of lamps whose radius is `factor` times that in the map, each with an error of
/// `size_sigma` of its own. The map states `stated_sigma`.
Verdicts verdicts(double factor, double size_sigma, int images, double stated_sigma = 0) {
  Scene map = room_of_six();
  for (Lamp& lamp : map.lamps) lamp.size_sigma = stated_sigma;
  Verdicts found;
  for (int i = 0; i < images; ++i) {
    Random random(static_cast<std::uint64_t>(i), 5);
    Scene truth = map;
    for (Lamp& lamp : truth.lamps) lamp.radius_m *= factor * (1 + size_sigma * random.normal());
    const Eigen::Vector3d at(random.uniform(1.5, 2.5), random.uniform(1.5, 2.5),
                             random.uniform(0.2, 0.8));
    const double turn = random.uniform(0, 6.28);
    const Rigid3 pose =
        look_at(at, {2 + random.uniform(-0.3, 0.3), 2, 3}, {std::sin(turn), std::cos(turn), 0.1});
    SimulateOptions options;
    options.seed = static_cast<std::uint64_t>(i);
    const Result<Fix> fix = locate(simulate(truth, pose, options).image.view(), map);
    ++found.images;
    found.advised += fix.message.find("1.5 times as large as predicted") != std::string::npos;
    if (!fix.ok()) continue;
    ++found.ok;
    const Eigen::Vector3d off_m = fix->position_m - at;
    found.worst_m = std::max(found.worst_m, off_m.norm());
    found.wrong += off_m.dot(fix->position_covariance_m2.inverse() * off_m) > 3 * 9;
    found.size_sigma =
        std::max(found.size_sigma, fix->candidates[0].estimated_size_sigma.value_or(0));
  }
  return found;
}

void expect_located(double factor, double size_sigma) {
  const Verdicts found = verdicts(factor, size_sigma, 12);
  SCOPED_TRACE(factor);
  EXPECT_GE(found.ok, 8);  // lamps cut by the border are no evidence
  EXPECT_EQ(found.wrong, 0);
  EXPECT_LT(found.worst_m, 0.01);
  EXPECT_NEAR(found.size_sigma, std::hypot(factor - 1, size_sigma), 0.3 * std::abs(factor - 1));
}

TEST(LitSize, SmallerThanStatedIsLocatedByDirections) { expect_located(0.86, 0); }

TEST(LitSize, LargerThanStatedIsLocatedByDirections) { expect_located(1.15, 0); }

TEST(LitSize, OfEachLampMayDiffer) { expect_located(0.88, 0.02); }

TEST(LitSize, LargeErrorsAreLocatedIfTheMapStatesThem) {
  const Verdicts found = verdicts(1.5, 0, 12, 0.3);
  EXPECT_GE(found.ok, 8);
  EXPECT_EQ(found.wrong, 0);
  EXPECT_LT(found.worst_m, 0.01);
}

TEST(LitSize, LargeErrorsThatAreNotStatedAreNamed) {
  const Verdicts found = verdicts(1.5, 0, 12);
  EXPECT_EQ(found.ok, 0);
  EXPECT_GE(found.advised, 8);
}

}  // namespace
}  // namespace occ
