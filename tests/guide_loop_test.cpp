// SPDX-License-Identifier: Apache-2.0
// The closed loop: a vehicle follows its route by rendered images, and docks.
#include <gtest/gtest.h>

#include <cmath>

#include "guide_loop_support.hpp"
#include "libocc/guide/mount.hpp"
#include "support.hpp"

namespace {

using occ::test::complaint;
using occ::test::four_lamp_room;
using occ::test::four_lamp_route;
using occ::test::real_vehicle;

constexpr double pi = 3.14159265358979323846;

occ::LoopOptions real_options(std::uint64_t seed = 1) {
  occ::LoopOptions options;
  options.vehicle = real_vehicle();
  options.seed = seed;
  return options;
}

void print(const occ::LoopResult& r) {
  const occ::LoopMetrics& m = r.metrics;
  std::printf(
      "%s (%s): %.1f s %.2f m, cross-track mean %.2f rmse %.2f max %.2f mm; est rmse %.2f max %.2f "
      "mm, %.3f deg; dock %.2f mm %.4f deg; frames %d avail %.4f three %.3f outage %.2f lost %.2f "
      "reloc %d nees %.2f nis %.2f; %.2f ms med, p99 %.2f; limited %d\n",
      to_string(r.outcome), r.message.c_str(), m.duration_s, m.driven_m, 1e3 * m.cross_track_mean_m,
      1e3 * m.cross_track_rmse_m, 1e3 * m.cross_track_max_m, 1e3 * m.position_rmse_m,
      1e3 * m.position_max_m, m.heading_rmse_rad * 180 / pi, 1e3 * m.final_position_error_m,
      m.final_heading_error_rad * 180 / pi, m.frames, m.availability, m.three_lamps,
      m.longest_outage_s, m.lost_s, m.relocations, m.nees, m.nis_per_dof, 1e3 * m.frame_median_s,
      1e3 * m.frame_p99_s, m.limited_steps);
}

}  // namespace

TEST(ClosedLoop, DrivesALapAndDocks) {
  const occ::LoopResult result =
      occ::closed_loop(four_lamp_room(), four_lamp_route(1), real_options());
  print(result);
  EXPECT_EQ(result.outcome, occ::LoopOutcome::arrived);
  EXPECT_LT(result.metrics.cross_track_rmse_m, 5e-3);
  EXPECT_LT(result.metrics.final_position_error_m, 2e-3);
  EXPECT_LT(result.metrics.final_heading_error_rad, 0.1 * pi / 180);
}

TEST(ClosedLoop, ThirtyRepeats) {
  const char* env = std::getenv("RUNS");
  const int runs = env ? atoi(env) : 3;
  for (int run = 0; run < runs; ++run)
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(),
                           real_options(static_cast<std::uint64_t>(run))));
}
TEST(ClosedLoop, LampFails) {
  for (int lamp = 0; lamp < 4; ++lamp) {
    occ::LoopOptions o = real_options(5);
    o.faults.lamp_failures = {{lamp, 20}};
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(), o));
  }
}
TEST(ClosedLoop, Faults) {
  {
    occ::LoopOptions o = real_options(5);
    o.faults.latency_s = 0.08;
    puts("latency");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    o.faults.frame_loss = 0.5;
    puts("loss");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    o.faults.frame_repeat = 0.5;
    puts("repeat");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    o.faults.odometry_lies = {{5, 8, 1.3, 0.2}};
    puts("lie");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    o.faults.kidnappings = {{5, {2.5, 2.3, 2}}};
    puts("kidnap");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    o.faults.clock_jumps = {{5, -0.5}};
    puts("clock");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    o.faults.clock_jumps = {{5, 0.5}};
    puts("clock+");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    for (int l = 0; l < 4; ++l) o.faults.lamp_failures.push_back({l, 5, 5.5});
    puts("dark");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    o.vehicle.drive = occ::Drive::ackermann;
    o.vehicle.wheelbase_m = .25;
    puts("car");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
  {
    occ::LoopOptions o = real_options(5);
    o.follower = occ::Follower::stanley;
    puts("stanley");
    print(occ::closed_loop(four_lamp_room(), four_lamp_route(1), o));
  }
}
