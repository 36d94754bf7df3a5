// SPDX-License-Identifier: Apache-2.0
// Closed loops with an alert limit: the vehicle stops while its position is not protected.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "libocc/guide/closed_loop.hpp"
#include "libocc/guide/mount.hpp"
#include "tests/guide/guide_loop_support.hpp"

namespace {

using occ::test::four_lamp_room;
using occ::test::four_lamp_route;
using occ::test::real_options;

// With three of the four lamps the level is 6 cm in a corner of the room.
constexpr double limit_m = 0.08;

occ::LoopOptions limited_options(double alert_limit_m) {
  occ::LoopOptions options = real_options();
  options.tracker.alert_limit_m = alert_limit_m;
  return options;
}

double error_m(const occ::LoopRecord& record) {
  return (record.estimate.pose.position() - record.truth.position()).norm();
}

}  // namespace

TEST(AlertLimit, WithAllLampsTheVehicleDrivesOn) {
  const occ::LoopResult result =
      occ::closed_loop(four_lamp_room(), four_lamp_route(1), limited_options(limit_m));
  EXPECT_EQ(result.outcome, occ::LoopOutcome::arrived) << result.message;
  EXPECT_LT(result.metrics.alert_s, 0.1);  // before the second image
  EXPECT_EQ(result.metrics.misleading_s, 0);
  EXPECT_GT(result.metrics.protection_level_m, result.metrics.position_rmse_m);
  EXPECT_LT(result.metrics.protection_level_m, limit_m);
}

TEST(AlertLimit, StopsWhileTooFewLampsAreOnAndThenDrivesOn) {
  occ::LoopOptions options = limited_options(limit_m);
  for (const int lamp : {0, 1, 2}) options.faults.lamp_failures.push_back({lamp, 3, 8});
  const occ::LoopResult result = occ::closed_loop(four_lamp_room(), four_lamp_route(1), options);
  EXPECT_EQ(result.outcome, occ::LoopOutcome::arrived) << result.message;
  EXPECT_GT(result.metrics.alert_s, 1);
  double stopped_s = 0;
  bool was_alert = false;
  for (const occ::LoopRecord& record : result.records) {
    EXPECT_TRUE(record.alert || error_m(record) < limit_m) << record.time_s;
    EXPECT_TRUE(!was_alert || record.command.speed_m_s == 0) << record.time_s;
    was_alert = record.alert;
    if (record.alert) stopped_s = record.time_s;
  }
  EXPECT_NEAR(stopped_s, 8, 0.2);
}

TEST(AlertLimit, EndsIfTheLampsStayOff) {
  occ::LoopOptions options = limited_options(limit_m);
  options.max_lost_s = 2;
  for (const int lamp : {0, 1, 2}) options.faults.lamp_failures.push_back({lamp, 3});
  const occ::LoopResult result = occ::closed_loop(four_lamp_room(), four_lamp_route(1), options);
  EXPECT_EQ(result.outcome, occ::LoopOutcome::lost);
  EXPECT_EQ(result.message.find("no protection level below the alert limit"), 0U) << result.message;
}

TEST(AlertLimit, HoldsWithOneWrongLampInTheMap) {
  for (const double moved_m : {0.01, 0.03, 0.1}) {
    occ::Scene map = four_lamp_room();
    map.lamps[1].centre_m.x() += moved_m;
    occ::LoopOptions options = limited_options(limit_m);
    options.max_lost_s = 1;
    const auto with_map = [&](const occ::Scene&) {
      return occ::make_tracker_estimator(map, options.tracker,
                                         occ::camera_on_vehicle(options.camera_place_m, 0, 0));
    };
    const occ::LoopResult result =
        occ::closed_loop(four_lamp_room(), four_lamp_route(1), options, with_map);
    EXPECT_EQ(result.metrics.misleading_s, 0) << moved_m;
    for (const occ::LoopRecord& record : result.records)
      EXPECT_TRUE(record.alert || error_m(record) < limit_m) << moved_m << " " << record.time_s;
  }
}
