// SPDX-License-Identifier: Apache-2.0
// Controllers with a perfect vehicle and a perfect estimate: accuracy on routes and at docks.
#include "libocc/guide/controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "libocc/guide/docking.hpp"
#include "tests/support/support.hpp"

namespace {

constexpr double dt_s = 0.01;

using Controller = std::function<occ::ControlOutput(const occ::Route&, const occ::Vehicle&,
                                                    const occ::ControlInput&)>;

occ::Route loop(double speed_m_s = 0.5, double radius_m = 0.5) {
  occ::RouteOptions options;
  options.closed = true;
  options.laps = 2;
  options.corner_radius_m = radius_m;
  options.speed_m_s = speed_m_s;
  return occ::Route({{{1, 1}, {}, {}}, {{4, 1}, {}, {}}, {{4, 3}, {}, {}}, {{1, 3}, {}, {}}},
                    options);
}

struct Followed {
  double rmse_m = 0, max_m = 0, duration_s = 0, last_m = 0;
  bool arrived = false;
};

Followed follow(const occ::Route& route, const occ::Vehicle& vehicle, const Controller& controller,
                const occ::PlanarPose& start) {
  occ::DriveState state{0, start, 0, 0, 0};
  occ::Random random(1);
  std::optional<double> along_m = 0;
  Followed result;
  int steps = 0;
  for (; steps < 10000 && !result.arrived; ++steps) {
    const occ::ControlOutput output =
        controller(route, vehicle, {state.pose, state.speed_m_s, state.turn_rate_rad_s, along_m});
    along_m = output.place.along_m;
    result.last_m = std::abs(output.place.deviation_m);
    result.rmse_m += std::pow(result.last_m, 2);
    result.max_m = std::max(result.max_m, result.last_m);
    state = occ::drive(vehicle, state, output.command, dt_s, random).state;
    result.arrived = output.at_end;
  }
  result.duration_s = steps * dt_s;
  result.rmse_m = std::sqrt(result.rmse_m / steps);
  return result;
}

Controller pursuit(const occ::PurePursuitOptions& options = {}) {
  return [options](const occ::Route& route, const occ::Vehicle& vehicle,
                   const occ::ControlInput& input) {
    return occ::pure_pursuit(route, vehicle, input, options);
  };
}

Controller by_stanley(const occ::StanleyOptions& options = {}) {
  return [options](const occ::Route& route, const occ::Vehicle& vehicle,
                   const occ::ControlInput& input) {
    return occ::stanley(route, vehicle, input, options);
  };
}

occ::Vehicle car() {
  occ::Vehicle vehicle;
  vehicle.drive = occ::Drive::ackermann;
  vehicle.wheelbase_m = 0.25;
  return vehicle;
}

}  // namespace

TEST(Controllers, FollowALoop) {
  const occ::PlanarPose start = loop().at(0).pose;
  for (const occ::Vehicle& vehicle : {occ::Vehicle{}, car()}) {
    for (const Controller& controller : {pursuit(), by_stanley()}) {
      const Followed followed = follow(loop(), vehicle, controller, start);
      EXPECT_TRUE(followed.arrived);
      EXPECT_LT(followed.rmse_m, 0.005);
      EXPECT_LT(followed.max_m, 0.015);
      EXPECT_LT(followed.duration_s, loop().length_m() / 0.5 + 4);
    }
  }
}

TEST(Controllers, ComeBackToTheRoute) {
  const occ::Route line({{{0, 0}, {}, {}}, {{8, 0}, {}, {}}});
  for (const occ::Vehicle& vehicle : {occ::Vehicle{}, car()}) {
    for (const Controller& controller : {pursuit(), by_stanley()}) {
      for (const double heading : {-0.5, 0.0, 0.7}) {
        const Followed followed = follow(line, vehicle, controller, {0, 0.3, heading});
        EXPECT_TRUE(followed.arrived);
        EXPECT_LT(followed.last_m, 0.003) << heading;
      }
    }
  }
}

TEST(Controllers, TurnOnTheSpotAtASharpCorner) {
  occ::RouteOptions options;
  options.corner_radius_m = 0;
  const occ::Route corner({{{0, 0}, {}, {}}, {{2, 0}, {}, {}}, {{2, 2}, {}, {}}}, options);
  occ::PurePursuitOptions slow;
  slow.lookahead_s = 0.1;
  const Followed followed = follow(corner, {}, pursuit(slow), {0, 0, 2});
  EXPECT_TRUE(followed.arrived);
  EXPECT_LT(followed.max_m, 0.4);
  EXPECT_LT(followed.last_m, 0.003);
}

TEST(Controllers, SlowDownForWhatIsAhead) {
  occ::PurePursuitOptions options;
  const occ::Route line({{{0, 0}, {}, {}}, {{3, 0}, {}, {}}});
  const auto speed_at = [&](double x, double speed) {
    return occ::pure_pursuit(line, {}, {{x, 0, 0}, speed, 0, {}}, options).command.speed_m_s;
  };
  EXPECT_NEAR(speed_at(1, 0.5), 0.5, 1e-12);
  EXPECT_NEAR(speed_at(2.9, 0.5), std::sqrt(2 * 0.7 * 0.5 * 0.1), 1e-9);
  EXPECT_NEAR(speed_at(3, 0.5), options.pace.min_speed_m_s, 1e-12);
  options.pace.slow_radius_m = 1;
  const occ::ControlOutput curve =
      occ::pure_pursuit(loop(), {}, {loop().at(2.3).pose, 0.5, 0, 2.3}, options);
  EXPECT_NEAR(curve.place.curvature_1_m, 2, 1e-12);
  EXPECT_NEAR(curve.command.speed_m_s, 0.25, 1e-12);
}

TEST(Controllers, ReportVehicleLimits) {
  const occ::ControlInput input{loop().at(1).pose, 0.5, 0, 1};
  for (const Controller& controller : {pursuit(), by_stanley()}) {
    const occ::ControlOutput output = controller(loop(3), {}, input);
    EXPECT_TRUE(output.speed_limited);
    EXPECT_LE(output.command.speed_m_s, occ::Vehicle{}.max_speed_m_s);
    EXPECT_FALSE(controller(loop(), {}, input).speed_limited);
  }
  const occ::ControlInput aside{{2.5, 1, 1.2}, 0.2, 0, 1};
  EXPECT_TRUE(occ::pure_pursuit(loop(), car(), aside).curve_limited);
  EXPECT_THROW(occ::stanley(loop(), {}, {{NAN, 0, 0}, 0, 0, {}}), std::invalid_argument);
}

namespace {

struct Docked {
  double aside_m = 0, along_m = 0, heading_rad = 0, duration_s = 0;
  bool done = false, retreated = false;
};

Docked docked(const occ::Vehicle& vehicle, const occ::PlanarPose& start,
              const occ::PlanarPose& target) {
  occ::DriveState state{0, start, 0, 0, 0};
  occ::Random random(1);
  occ::DockPhase phase = occ::DockPhase::approach;
  Docked result;
  for (; state.time_s < 120 && !(result.done && state.speed_m_s == 0);) {
    const occ::DockOutput output = occ::dock(state.pose, state.speed_m_s, target, vehicle, phase);
    phase = output.phase;
    result.done = phase == occ::DockPhase::docked;
    result.retreated = result.retreated || phase == occ::DockPhase::retreat;
    state = occ::drive(vehicle, state, output.command, dt_s, random).state;
  }
  const occ::PlanarPose in_dock = target.inverse() * state.pose;
  return {in_dock.y_m,  in_dock.x_m, in_dock.heading_rad,
          state.time_s, result.done, result.retreated};
}

}  // namespace

TEST(Docking, MeetsTheDockFromManySides) {
  const occ::PlanarPose target{2, 1, 0.8};
  for (const occ::PlanarPose& from :
       {occ::PlanarPose{-1, 0, 0}, {-1, 0.4, 0}, {-1.2, -0.3, 0.6}, {-0.8, 0.05, -0.4}}) {
    const Docked result = docked({}, target * from, target);
    EXPECT_TRUE(result.done);
    EXPECT_LT(std::hypot(result.aside_m, result.along_m), 5e-4) << from.y_m;
    EXPECT_LT(std::abs(result.heading_rad), 3e-4);
    EXPECT_LT(result.duration_s, 30);
  }
}

TEST(Docking, ACarMeetsItStraight) {
  const Docked result = docked(car(), {-1.5, 0.1, 0}, {});
  EXPECT_TRUE(result.done);
  EXPECT_LT(std::hypot(result.aside_m, result.along_m), 1e-3);
  EXPECT_LT(std::abs(result.heading_rad), 3e-3);
}

TEST(Docking, BacksOutWhenItWouldMiss) {
  const Docked result = docked({}, {-0.25, 0.2, 0}, {});
  EXPECT_TRUE(result.retreated);
  EXPECT_TRUE(result.done);
  EXPECT_LT(std::hypot(result.aside_m, result.along_m), 5e-4);
}

TEST(Docking, RejectsValuesThatAreNotFinite) {
  EXPECT_THROW(occ::dock({}, 0, {NAN, 0, 0}, {}, occ::DockPhase::approach), std::invalid_argument);
  occ::DockOptions options;
  options.track_length_m = 0;
  EXPECT_THROW(options.validate(), std::invalid_argument);
}
