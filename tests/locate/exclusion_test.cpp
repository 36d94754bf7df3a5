// SPDX-License-Identifier: Apache-2.0
// Lamps that are left out because they contradict the others.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// A room whose map has one lamp at a wrong place, and an image of it.
struct FaultyMap {
  Scene truth = test::irregular_room();
  Rigid3 pose = look_at({2.1, 1.8, 0.5}, {2.2, 2.0, 3.0}, {0.2, 1, 0});
  Image image;

  explicit FaultyMap(std::size_t lamps = 6) {
    truth.lamps.resize(lamps);
    for (std::size_t i = 0; i < lamps; ++i) truth.lamps[i].id = 10 + static_cast<int>(i);
    image = simulate(truth, pose).image;
  }
  Result<Fix> fix(std::size_t faulty, double shift_m) const {
    Scene map = truth;
    map.lamps[faulty].centre_m += Eigen::Vector3d(0.6, -0.8, 0) * shift_m;
    return locate(image.view(), map);
  }
  /// Position error in its standard deviations.
  double sigmas(const Fix& fix) const {
    return (fix.position_m - pose.origin_in_source()).norm() /
           std::sqrt(fix.position_covariance_m2.trace());
  }
};

TEST(Exclusion, LeavesOutTheLampThatIsNotWhereTheMapSays) {
  const FaultyMap room;
  for (const double shift_m : {0.0006, 0.001, 0.004, 0.01})
    for (std::size_t faulty = 0; faulty < room.truth.lamps.size(); ++faulty) {
      const Result<Fix> fix = room.fix(faulty, shift_m);
      ASSERT_TRUE(fix.ok()) << fix.message;
      EXPECT_EQ(fix->excluded_lamps, std::vector<int>{10 + static_cast<int>(faulty)}) << shift_m;
      EXPECT_EQ(fix->separation.excluded, 1);
      EXPECT_EQ(fix->separation.lamps.size(), 5u);
      EXPECT_LT(room.sigmas(fix.value), 2);
    }
}

TEST(Exclusion, NamesNoOtherLampIfTheErrorIsSmall) {
  const FaultyMap room;
  for (const double shift_m : {0.0, 0.0001, 0.0002, 0.0003, 0.0004})
    for (std::size_t faulty = 0; faulty < room.truth.lamps.size(); ++faulty) {
      const Result<Fix> fix = room.fix(faulty, shift_m);
      ASSERT_TRUE(fix.ok()) << fix.message;
      if (!fix->excluded_lamps.empty() && shift_m > 0) {
        EXPECT_EQ(fix->excluded_lamps, std::vector<int>{10 + static_cast<int>(faulty)});
      }
      EXPECT_EQ(fix->separation.excluded, static_cast<int>(fix->excluded_lamps.size()));
      EXPECT_TRUE(shift_m > 0 || fix->excluded_lamps.empty());
      EXPECT_TRUE(fix->excluded_lamps.empty() || room.sigmas(fix.value) < 2);
    }
}

TEST(Exclusion, NamesNoneOfFourLampsAnyOfWhichMayBeWrong) {
  const FaultyMap room(4);
  for (std::size_t faulty = 0; faulty < 4; ++faulty) {
    const Result<Fix> fix = room.fix(faulty, 0.004);
    EXPECT_NE(fix.message.find("contradict each other"), std::string::npos) << fix.message;
    EXPECT_LT(room.sigmas(fix.value), 2);
    EXPECT_TRUE(fix->excluded_lamps.empty());
  }
}

}  // namespace
}  // namespace occ
