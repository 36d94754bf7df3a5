// SPDX-License-Identifier: Apache-2.0
// Rooms in which a beam that is not on the map hides parts of the lamps.
#include <gtest/gtest.h>

#include "libocc/detect/detect.hpp"
#include "libocc/locate/internal/detect_options.hpp"
#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

Scene room_of_discs() {
  Lamp lamp;
  lamp.radius_m = 0.14;
  lamp.power_w = 3;
  return test::ceiling_of_six(lamp);
}

struct Beams {
  int ok = 0, used_in_part = 0, wrong = 0;
};

/// Locates a camera below beams of random places and widths of 0.15 to 0.5 m.
Beams locate_below_beams(int count, bool visible_rims) {
  constexpr double unlikely_chi2 = 21.1;  // 1e-4 at three degrees of freedom
  const Scene map = room_of_discs();
  DetectOptions options = internal::locate::detect_options_of(map, {});
  options.discs = visible_rims;
  Random random(3);
  Beams beams;
  for (int i = 0; i < count; ++i) {
    const double middle_m = random.uniform(-1, 0.9), half_m = random.uniform(0.07, 0.25);
    Scene room = map;
    room.boxes.push_back({{-3, middle_m - half_m, 2.3}, {3, middle_m + half_m, 2.45}});
    const Rigid3 pose = test::upward_view(random, 0.3, 0.1);
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(i);
    const Image image = simulate(room, pose, simulation).image;
    const Result<Fix> fix = locate(detect(image.view(), options), map);
    if (fix.status != Status::ok) continue;
    ++beams.ok;
    const Eigen::Vector3d error_m = fix->position_m - pose.origin_in_source();
    beams.wrong += test::nees(error_m, fix->position_covariance_m2) > unlikely_chi2;
    for (const auto& [id, blob] : fix->lamps) beams.used_in_part += blob.hidden_in_part;
  }
  return beams;
}

TEST(HiddenLamps, VisibleRimsLocateMoreImages) {
  const Beams by_visible_rims = locate_below_beams(120, true),
              without = locate_below_beams(120, false);
  EXPECT_GE(by_visible_rims.used_in_part, 12);
  EXPECT_EQ(without.used_in_part, 0);
  EXPECT_GT(by_visible_rims.ok, without.ok);
  EXPECT_EQ(by_visible_rims.wrong, 0);
}

}  // namespace
}  // namespace occ
