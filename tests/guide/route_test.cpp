// SPDX-License-Identifier: Apache-2.0
// Routes: lengths, points, corners and splines; routes through walls are rejected with the
// position.
#include "libocc/guide/route.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "libocc/core/math.hpp"
#include "tests/support/support.hpp"

namespace {

using occ::pi;
using occ::test::complaint;

std::vector<occ::RouteWaypoint> points(std::initializer_list<Eigen::Vector2d> positions) {
  std::vector<occ::RouteWaypoint> waypoints;
  for (const Eigen::Vector2d& position : positions) waypoints.push_back({position, {}, {}});
  return waypoints;
}

occ::Route ring(int laps = 1, double radius_m = 0.4) {
  occ::RouteOptions options;
  options.closed = true;
  options.laps = laps;
  options.corner_radius_m = radius_m;
  return occ::Route(points({{1, 1}, {3, 1}, {3, 2.5}, {1, 2.5}}), options);
}

/// Largest discontinuities of position and heading between pieces.
void expect_smooth(const occ::Route& route, double tolerance = 1e-9) {
  for (std::size_t i = 0; i + 1 < route.pieces().size(); ++i) {
    const occ::RoutePiece& piece = route.pieces()[i];
    const occ::PlanarPose end =
        piece.begin * occ::arc(piece.length_m, piece.length_m * piece.curvature_1_m);
    const Eigen::Vector3d jump = occ::difference(end, route.pieces()[i + 1].begin);
    EXPECT_LT(jump.norm(), tolerance) << "after piece " << i << ": " << jump.transpose();
  }
}

}  // namespace

TEST(Route, ClosedLinesHaveRoundCorners) {
  const occ::Route route = ring(3);
  const double lap = 2 * (2 + 1.5) - 8 * 0.4 + 2 * pi * 0.4;
  EXPECT_NEAR(route.length_m(), 3 * lap, 1e-9);
  expect_smooth(route);
  EXPECT_NEAR(occ::difference(route.at(lap).pose, route.at(0).pose).norm(), 0, 1e-9);
  EXPECT_NEAR(occ::difference(route.at(0.3 + 2 * lap).pose, route.at(0.3).pose).norm(), 0, 1e-9);
}

TEST(Route, ShortLinesHaveSharperCorners) {
  const occ::Route route = ring(1, 5);  // at most 0.75 m of each side
  expect_smooth(route);
  double sharpest = 0;
  for (const occ::RoutePiece& piece : route.pieces())
    sharpest = std::max(sharpest, std::abs(piece.curvature_1_m));
  EXPECT_NEAR(sharpest, 1 / 0.75, 1e-9);
}

TEST(Route, NearestFindsWhatAtGave) {
  const occ::Route route = ring();
  for (double along = 0.01; along < route.length_m(); along += 0.0137) {
    const occ::RoutePlace place = route.at(along);
    for (const double aside : {-0.1, 0.0, 0.05}) {
      const occ::RoutePlace found = route.nearest(place.pose * Eigen::Vector2d(0, aside));
      EXPECT_NEAR(found.along_m, along, 1e-9);
      EXPECT_NEAR(found.deviation_m, aside, 1e-9);
    }
  }
}

TEST(Route, AHintDistinguishesLaps) {
  const occ::Route route = ring(4);
  const double lap = route.length_m() / 4;
  const Eigen::Vector2d position = route.at(0.7).pose.position();
  EXPECT_NEAR(route.nearest(position, 2 * lap + 0.5).along_m, 2 * lap + 0.7, 1e-9);
  EXPECT_NEAR(route.nearest(position, 0.5).along_m, 0.7, 1e-9);
  EXPECT_LE(route.nearest(position, 3.5 * lap, 0.1).along_m, 3.5 * lap + 0.1 + 1e-12);
}

TEST(Route, LooksAheadByDistance) {
  const occ::Route route = ring();
  const Eigen::Vector2d position(1.5, 1.02);
  const occ::RoutePlace place = route.ahead(position, 0.1, 0.25);
  EXPECT_NEAR((place.pose.position() - position).norm(), 0.25, 1e-9);
  EXPECT_GT(place.along_m, 0.1);
  EXPECT_NEAR(route.ahead(position, 0.1, 100).along_m, route.length_m(), 1e-12);
}

TEST(Route, ASplineGoesThroughItsPointsSmoothly) {
  for (const bool closed : {false, true}) {
    occ::RouteOptions options;
    options.shape = occ::RouteShape::spline;
    options.closed = closed;
    const auto waypoints = points({{0, 0}, {1, 0.5}, {2, 0}, {2.5, 1.5}, {1, 2}});
    const occ::Route route(waypoints, options);
    expect_smooth(route);
    for (const occ::RouteWaypoint& waypoint : waypoints)
      EXPECT_NEAR(route.nearest(waypoint.position_m).deviation_m, 0, 1e-9);
    EXPECT_NEAR((route.at(route.length_m()).pose.position() -
                 waypoints[closed ? 0 : waypoints.size() - 1].position_m)
                    .norm(),
                0, 1e-9);
  }
}

TEST(Route, ASplineThroughACircleIsNearlyOne) {
  std::vector<occ::RouteWaypoint> waypoints;
  for (int i = 0; i < 16; ++i)
    waypoints.push_back({{std::cos(2 * pi * i / 16), std::sin(2 * pi * i / 16)}, {}, {}});
  occ::RouteOptions options;
  options.shape = occ::RouteShape::spline;
  options.closed = true;
  const occ::Route route(waypoints, options);
  EXPECT_NEAR(route.length_m(), 2 * pi, 1e-3);
  for (const occ::RoutePiece& piece : route.pieces()) EXPECT_NEAR(piece.curvature_1_m, 1, 0.03);
}

TEST(Route, SpeedsHoldFromTheirWaypointOn) {
  auto waypoints = points({{0, 0}, {1, 0}, {2, 0}});
  waypoints[1].speed_m_s = 0.2;
  const occ::Route route(waypoints);
  EXPECT_EQ(route.at(0.5).speed_m_s, 0.5);
  EXPECT_EQ(route.at(1.5).speed_m_s, 0.2);
}

TEST(Route, RejectsInvalidRoutes) {
  EXPECT_NE(complaint([] { occ::Route(points({{0, 0}})); }).find("waypoints"), std::string::npos);
  EXPECT_NE(complaint([] {
              occ::Route(points({{0, 0}, {1, 0}, {1, 0}}));
            }).find("waypoints[2]"),
            std::string::npos);
  EXPECT_NE(complaint([] {
              occ::Route(points({{0, 0}, {1, 0}, {0, 0}}));
            }).find("reverses"),
            std::string::npos);
  occ::RouteOptions options;
  options.laps = 2;
  EXPECT_NE(complaint([&] { options.validate(); }).find("laps"), std::string::npos);
}

TEST(RouteConflicts, ReportPositionAndObject) {
  occ::Scene scene = occ::test::square_room();
  scene.room = occ::Room{};
  occ::Box box;
  box.min_m = {1.9, 0.8, 0};
  box.max_m = {2.1, 1.2, 1};
  scene.boxes = {box};
  const occ::Route route(points({{1, 1}, {3, 1}, {3, 3.9}}));
  const auto conflicts = occ::route_conflicts(route, scene, 0.2, 0.5);
  ASSERT_EQ(conflicts.size(), 2u);
  EXPECT_EQ(conflicts[0].what, "boxes[0]");
  EXPECT_NEAR(conflicts[0].from_m, 0.7, 0.006);
  EXPECT_NEAR(conflicts[0].to_m, 1.3, 0.006);
  EXPECT_NEAR(conflicts[0].clearance_m, -0.3, 0.006);
  EXPECT_EQ(conflicts[1].what, "a wall");
  EXPECT_NEAR(conflicts[1].position_m.y(), 3.9, 1e-9);
  const std::string said = complaint([&] { occ::require_free(route, scene, 0.2, 0.5); });
  EXPECT_NE(said.find("boxes[0]"), std::string::npos) << said;
  scene.boxes.clear();
  EXPECT_NO_THROW(occ::require_free(ring(), scene, 0.2, 0.5));
}

TEST(RouteConflicts, ABoxAboveTheVehicleIsNoConflict) {
  occ::Scene scene = occ::test::square_room();
  occ::Box shelf;
  shelf.min_m = {1.9, 0.8, 1};
  shelf.max_m = {2.1, 1.2, 2};
  scene.boxes = {shelf};
  EXPECT_TRUE(occ::route_conflicts(ring(), scene, 0.2, 0.9).empty());
  EXPECT_FALSE(occ::route_conflicts(ring(), scene, 0.2, 1.1).empty());
}

TEST(RouteConflicts, TheDockCounts) {
  occ::Scene scene = occ::test::square_room();
  scene.room = occ::Room{};
  occ::RouteOptions options;
  options.dock = occ::PlanarPose{3.9, 1, 0};
  EXPECT_EQ(
      occ::route_conflicts(occ::Route(points({{1, 1}, {3, 1}}), options), scene, 0.2, 1).size(),
      1u);
}
