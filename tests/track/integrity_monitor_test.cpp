// SPDX-License-Identifier: Apache-2.0
// Tracker::protection_level_m: bounds the error although lamps of the map are wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "libocc/geometry/motion.hpp"
#include "libocc/scene/scene_file.hpp"
#include "libocc/simulate/renderer.hpp"
#include "libocc/track/tracker.hpp"
#include "tests/support/support.hpp"

namespace {

using occ::PlanarPose;
using occ::Scene;
using occ::test::complaint;

constexpr double frame_s = 1.0 / 30;
constexpr int frames = 30;

Scene six_lamps() {
  return occ::read_scene(std::string(LIBOCC_DATA) + "/scenes/irregular_six.yaml");
}

/// Camera 0.3 m in front of the vehicle's origin, looking up.
occ::Rigid3 mount() { return occ::look_at({0.3, 0, 0.4}, {0.3, 0, 1}, {0, 1, 0}); }

PlanarPose pose_at(int frame) {
  const double angle = 0.02 * frame;
  return {1.2 + 0.6 * std::sin(angle), 2.3 - 0.6 * std::cos(angle), angle};
}

occ::TrackerOptions options_with(double alert_limit_m) {
  occ::TrackerOptions options;
  options.floor.emplace();
  options.alert_limit_m = alert_limit_m;
  return options;
}

struct Step {
  double error_m, level_m;
  occ::TrackedFrame frame;
};

/// Drives an arc in the world `real`. The tracker's map is `map`; all lamps are off from image
/// `dark_from` to `dark_to`.
std::vector<Step> drive(const Scene& real, const Scene& map, int dark_from = frames,
                        int dark_to = frames, double odometry_sigma = 1e-4) {
  Scene off = real;
  for (occ::Lamp& lamp : off.lamps) lamp.power_w = 1e-9;
  occ::Renderer lit(real), dark(off);
  occ::Tracker tracker(map, options_with(0.05), mount());
  std::vector<Step> steps;
  occ::SimulateOptions options;
  options.seed = 1;
  occ::Rendered rendered;
  for (int i = 0; i < frames; ++i) {
    const double time_s = frame_s * i;
    if (i > 0) {
      const PlanarPose moved = pose_at(i - 1).inverse() * pose_at(i);
      tracker.add(
          occ::PlanarOdometry{time_s - frame_s, time_s, moved,
                              odometry_sigma * odometry_sigma * Eigen::Matrix3d::Identity()});
    }
    options.frame = static_cast<std::uint32_t>(i);
    const bool is_dark = i >= dark_from && i < dark_to;
    (is_dark ? dark : lit).render(mount() * body_from_world(pose_at(i)), options, rendered);
    Step step{0, 0, tracker.add_image(rendered.image.view(), time_s)};
    step.level_m = tracker.protection_level_m(time_s);
    if (const auto known = tracker.planar(time_s))
      step.error_m = (known->pose.position() - pose_at(i).position()).norm();
    steps.push_back(step);
  }
  return steps;
}

}  // namespace

TEST(IntegrityMonitor, BoundsTheErrorWithinTheLimit) {
  const std::vector<Step> steps = drive(six_lamps(), six_lamps());
  for (std::size_t i = 1; i < steps.size(); ++i) {
    EXPECT_LT(steps[i].error_m, steps[i].level_m) << "image " << i;
    EXPECT_LT(steps[i].level_m, 0.05) << "image " << i;
    EXPECT_EQ(steps[i].frame.protection_level_m, steps[i].level_m);
    EXPECT_EQ(steps[i].frame.reason, "");
  }
}

TEST(IntegrityMonitor, InSpaceItHoldsAtTheTimesOfTheImages) {
  // Without a floor there is no odometry that could carry the level to other times.
  occ::TrackerOptions options = options_with(0.05);
  options.floor.reset();
  occ::Tracker tracker(six_lamps(), options);
  occ::Renderer lit(six_lamps());
  occ::SimulateOptions simulated;
  occ::Rendered rendered;
  for (int i = 0; i < 4; ++i) {
    const double time_s = frame_s * i;
    simulated.frame = static_cast<std::uint32_t>(i);
    const occ::Rigid3 pose = mount() * body_from_world(pose_at(0));
    lit.render(pose, simulated, rendered);
    const occ::TrackedFrame frame = tracker.add_image(rendered.image.view(), time_s);
    const Eigen::Vector3d off_m = frame.position_m - pose.origin_in_source();
    if (i == 0) continue;
    EXPECT_LT(frame.protection_level_m, 0.05);
    EXPECT_LT(off_m.head<2>().norm(), frame.protection_level_m);
    EXPECT_EQ(tracker.protection_level_m(time_s + 0.5 * frame_s),
              std::numeric_limits<double>::infinity());
  }
}

TEST(IntegrityMonitor, BoundsTheErrorOfAWrongMap) {
  double max_error_m = 0;
  for (const double moved_m : {0.003, 0.01, 0.03, 0.1})
    for (std::size_t lamp = 0; lamp < 6; ++lamp) {
      Scene map = six_lamps();
      map.lamps[lamp].centre_m += Eigen::Vector3d(moved_m, -0.5 * moved_m, 0);
      for (const Step& step : drive(six_lamps(), map)) {
        EXPECT_LE(step.error_m, step.level_m) << moved_m << " m, lamp " << lamp;
        max_error_m = std::max(max_error_m, step.error_m);
      }
    }
  EXPECT_GT(max_error_m, 2e-3);  // the faults have an effect
}

TEST(IntegrityMonitor, GrowsWithTheDistanceWhileTheLampsAreOff) {
  const std::vector<Step> steps = drive(six_lamps(), six_lamps(), 10, 20);
  for (int i = 10; i < 20; ++i) {
    EXPECT_EQ(steps[i].frame.state, occ::TrackerState::coasting);
    EXPECT_GT(steps[i].level_m, steps[i - 1].level_m);
    EXPECT_LT(steps[i].error_m, steps[i].level_m);
  }
  EXPECT_LT(steps[21].level_m, steps[19].level_m);
}

TEST(IntegrityMonitor, AStepInTheDarkAddsTheQuantileOfItsLength) {
  constexpr int dark = 10;
  constexpr double sigma_m = 0.05;
  const double risk = occ::TrackerOptions{}.integrity_risk / 3;
  const auto growth_m = [&](double odometry_sigma) {
    const auto steps = drive(six_lamps(), six_lamps(), dark, frames, odometry_sigma);
    return steps[dark].level_m - steps[dark - 1].level_m;
  };
  const double quantile = std::sqrt(-2 * std::log(risk));
  EXPECT_NEAR(growth_m(2 * sigma_m) - growth_m(sigma_m), quantile * sigma_m, 0.02 * sigma_m);
}

TEST(IntegrityMonitor, OneLampAloneHasNoLevel) {
  Scene real = six_lamps();
  for (std::size_t i = 1; i < real.lamps.size(); ++i) real.lamps[i].power_w = 1e-9;
  occ::Renderer renderer(real);
  occ::Rendered rendered;
  renderer.render(mount() * body_from_world(pose_at(0)), {}, rendered);
  occ::Tracker tracker(six_lamps(), options_with(0.05), mount());
  tracker.start(0, body_from_world(pose_at(0)), 1e-6 * occ::Matrix6::Identity());
  const occ::TrackedFrame frame = tracker.add_image(rendered.image.view(), frame_s);
  EXPECT_EQ(frame.state, occ::TrackerState::tracking);
  EXPECT_TRUE(std::isinf(frame.protection_level_m));
  EXPECT_EQ(frame.reason, "protection level inf m is above the alert limit 0.05 m");
}

TEST(IntegrityMonitor, WithoutALimitThereIsNoLevel) {
  occ::TrackerOptions options;
  options.floor.emplace();
  occ::Renderer renderer(six_lamps());
  occ::Rendered rendered;
  renderer.render(mount() * body_from_world(pose_at(0)), {}, rendered);
  occ::Tracker tracker(six_lamps(), options, mount());
  tracker.add_image(rendered.image.view(), 0);
  const occ::TrackedFrame frame = tracker.add_image(rendered.image.view(), frame_s);
  EXPECT_EQ(frame.state, occ::TrackerState::tracking);
  EXPECT_TRUE(std::isinf(frame.protection_level_m));
  EXPECT_EQ(frame.reason, "");
}

TEST(IntegrityMonitor, OptionsAreChecked) {
  for (const double limit_m : {0.0, -1.0, std::nan("")})
    EXPECT_NE(
        complaint([&] { occ::Tracker(six_lamps(), options_with(limit_m)); }).find("alert_limit_m"),
        std::string::npos);
  occ::TrackerOptions options = options_with(0.05);
  options.integrity_risk = 0;
  EXPECT_NE(complaint([&] { options.validate(); }).find("integrity_risk"), std::string::npos);
}
