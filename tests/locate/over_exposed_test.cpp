// SPDX-License-Identifier: Apache-2.0
// Rooms that are exposed several times too long: the errors of the poses are those that their
// covariances state.
#include <gtest/gtest.h>

#include <string>

#include "libocc/locate/locate.hpp"
#include "libocc/simulate/simulate.hpp"
#include "tests/support/nees.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

/// Six lamps, of which the brightest is exposed that many times too long.
Scene room_of(LampShape shape, double over_exposure) {
  constexpr double full_scale_power_w = 12;  // of a lamp of 0.1 m^2 above the camera
  Lamp lamp;
  lamp.shape = shape;
  lamp.radius_m = 0.175;
  lamp.size_m = {0.35, 0.35};
  lamp.x_axis = {1, 0, 0};
  lamp.power_w = over_exposure * full_scale_power_w;
  return test::ceiling_of_six(lamp);
}

struct Located {
  int located = 0, other = 0;
  double nees = 0;  // sum of the normalised squared errors of positions
};

Located locate_images(const Scene& scene, int count) {
  Random random(3);
  Located out;
  for (int i = 0; i < count; ++i) {
    const Rigid3 pose = test::upward_view(random, -0.2, 0.15);
    SimulateOptions simulation;
    simulation.seed = static_cast<std::uint64_t>(i);
    const Result<Fix> fix = locate(simulate(scene, pose, simulation).image.view(), scene);
    if (fix.status == Status::ok) {
      ++out.located;
      out.nees +=
          test::nees(fix->position_m - pose.origin_in_source(), fix->position_covariance_m2);
    } else if (fix.status != Status::ambiguous) {  // with few lamps in view
      ++out.other;
    }
  }
  return out;
}

TEST(OverExposed, TheErrorsAreThoseOfTheCovariances) {
  for (const LampShape shape : {LampShape::disc, LampShape::rectangle})
    for (const double over_exposure : {1.5, 3.0, 6.0}) {
      SCOPED_TRACE(std::string(shape == LampShape::disc ? "discs" : "panels") + ", exposed " +
                   std::to_string(over_exposure) + " times too long");
      const Located located = locate_images(room_of(shape, over_exposure), 60);
      EXPECT_GE(located.located, 35);
      EXPECT_EQ(located.other, 0);
      EXPECT_GT(located.nees / (3 * located.located), 0.12);
      EXPECT_LT(located.nees, test::chi2_interval(3.0 * located.located).second);
    }
}

}  // namespace
}  // namespace occ
