// SPDX-License-Identifier: Apache-2.0
// Closed loops in a world that differs from the scene of the estimator.
#include <gtest/gtest.h>

#include "libocc/guide/closed_loop.hpp"
#include "tests/guide/guide_loop_support.hpp"
#include "tests/support/support.hpp"

namespace {

using occ::test::complaint;
using occ::test::four_lamp_room;
using occ::test::four_lamp_route;
using occ::test::real_options;

occ::LoopResult lap(const occ::LoopOptions& options) {
  return occ::closed_loop(four_lamp_room(), four_lamp_route(1), options);
}

/// The errors of the world that a site has, and their stated sigmas.
occ::LoopOptions wrong_world(std::uint64_t seed) {
  occ::LoopOptions options = real_options();
  options.seed = seed;
  options.world.map_sigma_m = 0.003;
  options.world.mount_rotation_rad = {0.003, 0, 0};
  options.world.clock_s = 0.005;
  return options;
}

}  // namespace

TEST(LoopWorld, WithoutErrorsNothingChanges) {
  occ::LoopOptions options = real_options();
  const occ::LoopResult assumed = lap(options);
  options.world.floor_wave_m = 3;  // of no effect on an even floor
  options.world.ambient_flicker = 0.5;
  options.world.lens = {{"k1", 0.0}};
  const occ::LoopResult same = lap(options);
  EXPECT_EQ(same.records.back().truth.x_m, assumed.records.back().truth.x_m);
  EXPECT_EQ(same.metrics.nees, assumed.metrics.nees);
}

TEST(LoopWorld, EachErrorMovesTheEstimate) {
  const double exact_m = lap(real_options()).metrics.position_rmse_m;
  const auto error_m = [&](const auto& change) {
    occ::LoopOptions options = real_options();
    change(options.world);
    return lap(options).metrics.position_rmse_m;
  };
  EXPECT_GT(error_m([](occ::WorldErrors& w) { w.map_sigma_m = 0.005; }), 2 * exact_m);
  EXPECT_GT(error_m([](occ::WorldErrors& w) { w.lens = {{"k1", -0.02}}; }), 2 * exact_m);
  EXPECT_GT(error_m([](occ::WorldErrors& w) { w.mount_shift_m = {0.01, 0, 0}; }), 5e-3);
  EXPECT_GT(error_m([](occ::WorldErrors& w) { w.mount_rotation_rad = {0.01, 0, 0}; }), 5e-3);
  EXPECT_GT(error_m([](occ::WorldErrors& w) { w.clock_s = 0.02; }), 5e-3);
  EXPECT_NE(error_m([](occ::WorldErrors& w) { w.floor_height_m = 0.002; }), exact_m);
  // The default sigmas of the floor contain its waves.
  EXPECT_LT(error_m([](occ::WorldErrors& w) { w.floor_tilt_rad = 0.003; }), 2 * exact_m);
  EXPECT_NEAR(error_m([](occ::WorldErrors& w) { w.exposure = 0.7; }), exact_m, 2e-4);
  EXPECT_NEAR(error_m([](occ::WorldErrors& w) {
                w.ambient_w_m2 = 1e-4;
                w.ambient_flicker = 0.5;
              }),
              exact_m, 5e-4);
}

TEST(LoopWorld, StatedErrorsAreInTheCovariance) {
  double unstated = 0, stated = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    occ::LoopOptions options = wrong_world(seed);
    unstated += lap(options).metrics.nees / 3;
    options.tracker.mount_sigma_rad = 0.003;
    options.tracker.clock_sigma_s = 0.005;
    occ::Scene scene = four_lamp_room();
    scene.map_sigma_m = 0.003;
    const occ::LoopResult result = occ::closed_loop(scene, four_lamp_route(1), options);
    EXPECT_EQ(result.outcome, occ::LoopOutcome::arrived) << result.message;
    EXPECT_LT(result.metrics.position_rmse_m, 3 * result.metrics.position_sigma_m);
    stated += result.metrics.nees / 3;
  }
  EXPECT_GT(unstated, 9);  // 3 expected
  EXPECT_LT(stated, 12);
}

TEST(LoopWorld, ErrorsThatAreNoneAreRefused) {
  const auto refusal = [](const auto& change) {
    occ::LoopOptions options = real_options();
    change(options.world);
    return complaint([&] { lap(options); });
  };
  EXPECT_NE(refusal([](occ::WorldErrors& w) {
              w.lens = {{"k9", 1.0}};
            }).find("world.lens"),
            std::string::npos);
  EXPECT_NE(refusal([](occ::WorldErrors& w) { w.map_sigma_m = -1; }).find("map_sigma_m"),
            std::string::npos);
  EXPECT_NE(refusal([](occ::WorldErrors& w) { w.exposure = 0; }).find("exposure"),
            std::string::npos);
  EXPECT_NE(refusal([](occ::WorldErrors& w) { w.ambient_flicker = 2; }).find("ambient_flicker"),
            std::string::npos);
}
