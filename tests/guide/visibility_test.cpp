// SPDX-License-Identifier: Apache-2.0
// Visibility from a floor, and plans that keep lamps in view: routes, and pan and tilt of a camera.
#include "libocc/guide/visibility.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/guide/mount.hpp"
#include "libocc/guide/plan_pan_tilt.hpp"
#include "libocc/guide/plan_route.hpp"
#include "libocc/refine/bound.hpp"
#include "libocc/simulate/received_power.hpp"
#include "tests/guide/guide_loop_support.hpp"
#include "tests/support/support.hpp"

namespace {

using occ::test::complaint;
using occ::test::four_lamp_room;
using occ::test::four_lamp_route;
using occ::test::narrow_room;

occ::RoutePlanOptions plan_options() {
  occ::RoutePlanOptions options;
  options.vehicle_radius_m = 0.2;
  return options;
}

}  // namespace

TEST(Mount, FollowsPanAndTilt) {
  const occ::Rigid3 up = occ::camera_on_vehicle({0.1, 0.2, 1.5});
  EXPECT_NEAR((up.rotation - Eigen::Matrix3d::Identity()).norm(), 0, 1e-15);
  EXPECT_NEAR((up.origin_in_source() - Eigen::Vector3d(0.1, 0.2, 1.5)).norm(), 0, 1e-15);
  const occ::Rigid3 turned = occ::camera_on_vehicle({0, 0, 1}, 0.7, 0.4);
  const Eigen::Vector3d view = turned.rotation.row(2);
  EXPECT_NEAR((view - Eigen::Vector3d(std::sin(0.4) * std::cos(0.7), std::sin(0.4) * std::sin(0.7),
                                      std::cos(0.4)))
                  .norm(),
              0, 1e-12);
}

TEST(Visibility, CountsWholeLampsAndTheirPower) {
  const occ::Scene scene = four_lamp_room();
  const occ::Visibility middle = occ::visibility(scene, occ::PlanarPose{2, 2, 0});
  EXPECT_EQ(middle.lamps, (std::vector<int>{0, 1, 2, 3}));
  const occ::Rigid3 pose = occ::camera_on_vehicle({0, 0, 1.5}) * occ::body_from_world({2, 2, 0});
  EXPECT_NEAR(middle.power_w, occ::received_power(scene, pose).total_w(), 1e-18);
  const occ::Visibility corner = occ::visibility(scene, occ::PlanarPose{0.5, 0.5, 0});
  EXPECT_LT(corner.lamps.size(), 4u);
  EXPECT_GT(corner.position_sigma_m, 0);
  EXPECT_TRUE(occ::visibility(scene, occ::PlanarPose{-1, 2, 0}).lamps.empty());
}

TEST(Visibility, ABoxHidesLamps) {
  occ::Scene scene = four_lamp_room();
  occ::Box box;
  box.min_m = {1.4, 1.4, 2};
  box.max_m = {1.6, 1.6, 2.4};
  scene.boxes = {box};
  const occ::Visibility seen = occ::visibility(scene, occ::PlanarPose{2, 2, 0});
  EXPECT_EQ(seen.lamps, (std::vector<int>{1, 2, 3}));
}

// The bound on the floor equals that of the camera pose with a known floor.
TEST(Visibility, BoundIsThatOfThePoseOnAFloor) {
  const occ::Scene scene = four_lamp_room();
  occ::VisibilityOptions options;
  options.heading_sigma_rad = std::numeric_limits<double>::infinity();
  options.camera_tilt_rad = 0.1;
  const occ::PlanarPose place{1.9, 2.1, 0.7};
  const occ::Visibility seen = occ::visibility(scene, place, options);
  std::vector<Eigen::Vector3d> points;
  for (const occ::Lamp& lamp : scene.lamps) points.push_back(lamp.centre_m);
  const auto px = [&](const Eigen::VectorXd& pose) {
    Eigen::VectorXd all(8);
    const occ::Rigid3 cam = occ::camera_on_vehicle({0, 0, 1.5}, 0, 0.1) *
                            occ::body_from_world({pose[0], pose[1], pose[2]});
    for (int i = 0; i < 4; ++i) all.segment<2>(2 * i) = *scene.camera.project(cam * points[i]);
    return all;
  };
  const Eigen::MatrixXd jacobian =
      occ::test::numerical_jacobian(px, Eigen::Vector3d(1.9, 2.1, 0.7));
  const Eigen::Matrix3d covariance =
      (jacobian.transpose() * jacobian / (options.sigma_px * options.sigma_px)).inverse();
  EXPECT_NEAR(seen.position_sigma_m, std::sqrt(covariance(0, 0) + covariance(1, 1)),
              1e-6 * seen.position_sigma_m);
  EXPECT_NEAR(seen.heading_sigma_rad, std::sqrt(covariance(2, 2)), 1e-6 * seen.heading_sigma_rad);
  const occ::Rigid3 pose =
      occ::camera_on_vehicle({0, 0, 1.5}, 0, 0.1) * occ::body_from_world(place);
  const auto free = occ::pose_bound(points, scene.camera, pose, options.sigma_px);
  EXPECT_LT(seen.position_sigma_m, std::sqrt(free->position_covariance_m2.trace()));
}

TEST(Visibility, OneLampNeedsTheHeading) {
  const occ::Scene scene = narrow_room();
  occ::VisibilityOptions options;
  const occ::PlanarPose under{1, 1, 0.3};
  const occ::Visibility with = occ::visibility(scene, under, options);
  ASSERT_EQ(with.lamps, std::vector<int>{0});
  EXPECT_LT(with.position_sigma_m, 0.01);
  options.heading_sigma_rad = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isinf(occ::visibility(scene, under, options).position_sigma_m));
}

TEST(Visibility, RejectsBadOptions) {
  occ::VisibilityOptions options;
  options.sigma_px = 0;
  EXPECT_NE(complaint([&] { options.validate(); }).find("sigma_px"), std::string::npos);
  EXPECT_NE(complaint([] {
              occ::visibility(four_lamp_room(), {{0, NAN, 0}});
            }).find("poses[0]"),
            std::string::npos);
}

TEST(PlanRoute, IsStraightWhereEverythingIsSeen) {
  const occ::RoutePlan plan =
      occ::plan_route(four_lamp_room(), {1, 2, 0}, {{{3, 2}, {}}}, plan_options());
  ASSERT_EQ(plan.status, occ::PlanStatus::ok) << plan.message;
  EXPECT_NEAR(plan.route->length_m(), 2, 0.08);
  EXPECT_EQ(plan.waypoints.size(), 2u);
  EXPECT_EQ(plan.seen_share, 1);
}

// With a long lens no lamp is visible from the middle of the room; the route leads along the lamps.
TEST(PlanRoute, FollowsTheLampsInView) {
  const occ::Scene scene = narrow_room();
  const occ::RoutePlanOptions options = plan_options();
  const occ::Route straight({{{1, 1}, {}, {}}, {{3, 3}, {}, {}}});
  const auto gaps = occ::view_gaps(scene, straight, options);
  ASSERT_FALSE(gaps.empty());
  EXPECT_NEAR((gaps[0].from + gaps[0].to).x() / 2, 2, 0.05);
  const occ::RoutePlan plan = occ::plan_route(scene, {1, 1, 0}, {{{3, 3}, {}}}, options);
  ASSERT_EQ(plan.status, occ::PlanStatus::ok) << plan.message;
  EXPECT_GT(plan.route->length_m(), 2.83);
  EXPECT_TRUE(occ::view_gaps(scene, *plan.route, options).empty());
  EXPECT_TRUE(occ::route_conflicts(*plan.route, scene, 0.2, 0.5).empty());
}

TEST(PlanRoute, GoesAroundABox) {
  occ::Scene scene = four_lamp_room();
  occ::Box box;
  box.min_m = {1.8, 1.5, 0};
  box.max_m = {2.2, 2.5, 0.8};
  scene.boxes = {box};
  const occ::RoutePlan plan = occ::plan_route(scene, {1, 2, 0}, {{{3, 2}, 0.0}}, plan_options());
  ASSERT_EQ(plan.status, occ::PlanStatus::ok) << plan.message;
  EXPECT_TRUE(occ::route_conflicts(*plan.route, scene, 0.2, 0.5).empty());
  EXPECT_NEAR(plan.route->at(1e9).pose.heading_rad, 0, 1e-9);
  EXPECT_LT((plan.route->at(1e9).pose.position() - Eigen::Vector2d(3, 2)).norm(), 0.071);
}

TEST(PlanRoute, ReportsSectionsWithoutView) {
  occ::Scene scene = four_lamp_room();
  occ::Box wall;
  wall.min_m = {1.9, 0, 0};
  wall.max_m = {2.1, 4, 1};
  scene.boxes = {wall};
  const occ::RoutePlan blocked = occ::plan_route(scene, {1, 2, 0}, {{{3, 2}, {}}}, plan_options());
  EXPECT_EQ(blocked.status, occ::PlanStatus::blocked);
  EXPECT_NE(blocked.message.find("(1.6"), std::string::npos) << blocked.message;
  EXPECT_EQ(occ::plan_route(scene, {2, 2, 0}, {{{3, 2}, {}}}, plan_options()).status,
            occ::PlanStatus::start_blocked);
  EXPECT_EQ(occ::plan_route(scene, {1, 2, 0}, {{{2, 2}, {}}}, plan_options()).status,
            occ::PlanStatus::goal_blocked);
  occ::RoutePlanOptions two = plan_options();
  two.min_lamps = 2;
  const occ::RoutePlan blind = occ::plan_route(narrow_room(), {1, 1, 0}, {{{3, 3}, {}}}, two);
  EXPECT_EQ(blind.status, occ::PlanStatus::blind);
  EXPECT_FALSE(blind.gaps.empty());
  EXPECT_LT(blind.seen_share, 1);
  EXPECT_NE(blind.message.find("without view"), std::string::npos);
}

TEST(PlanRoute, MeetsGoalsInTheirOrder) {
  const occ::RoutePlan plan = occ::plan_route(
      four_lamp_room(), {1, 1, 0}, {{{3, 1}, {}}, {{3, 3}, {}}, {{1, 3}, {}}}, plan_options());
  ASSERT_EQ(plan.status, occ::PlanStatus::ok) << plan.message;
  double along = 0;
  for (const Eigen::Vector2d& goal : {Eigen::Vector2d(3, 1), {3, 3}, {1, 3}}) {
    const occ::RoutePlace place = plan.route->nearest(goal);
    EXPECT_LT((place.pose.position() - goal).norm(), 0.08);
    EXPECT_GT(place.along_m, along);
    along = place.along_m;
  }
}

TEST(PlanRoute, KeepsTheBoundBelowALimit) {
  occ::RoutePlanOptions options = plan_options();
  options.max_sigma_m = 4e-4;
  const occ::RoutePlan plan =
      occ::plan_route(four_lamp_room(), {1.2, 2, 0}, {{{2.8, 2}, {}}}, options);
  ASSERT_TRUE(plan.route);
  for (const occ::RoutePlace& place : plan.route->sampled(0.1)) {
    const double sigma = occ::visibility(four_lamp_room(), place.pose).position_sigma_m;
    if (plan.status == occ::PlanStatus::ok) {
      EXPECT_LE(sigma, options.max_sigma_m);
    }
  }
  options.max_sigma_m = 1e-9;
  EXPECT_EQ(occ::plan_route(four_lamp_room(), {1.2, 2, 0}, {{{2.8, 2}, {}}}, options).status,
            occ::PlanStatus::blind);
}

TEST(PlanPanTilt, KeepsLampsInViewWhereAFixedCameraLosesThem) {
  const occ::Scene scene = narrow_room();
  const occ::Route route = four_lamp_route(1);
  occ::RoutePlanOptions fixed = plan_options();
  const auto gaps = occ::view_gaps(scene, route, fixed);
  double lost_m = 0;
  for (const occ::ViewGap& gap : gaps) lost_m += gap.to_m - gap.from_m;
  EXPECT_GT(lost_m, 0.1 * route.length_m());
  const occ::PanTiltResult result = occ::plan_pan_tilt(scene, route);
  EXPECT_EQ(result.status, occ::PlanStatus::ok) << result.message;
  EXPECT_EQ(result.seen_share, 1);
  const occ::PanTiltOptions options;
  for (double along = 0; along < route.length_m(); along += 0.05) {
    const occ::PanTiltKnot knot = result.plan.at(along);
    occ::VisibilityOptions view;
    view.camera_pan_rad = knot.pan_rad;
    view.camera_tilt_rad = knot.tilt_rad;
    EXPECT_GE(occ::visibility(scene, route.at(along).pose, view).lamps.size(), 1u) << along;
    const occ::PanTiltKnot soon = result.plan.at(along + 0.05);  // 0.1 s later
    EXPECT_LE(std::abs(soon.pan_rad - knot.pan_rad), 0.1 * options.pan_rate_rad_s + 1e-9);
    EXPECT_LE(std::abs(soon.tilt_rad - knot.tilt_rad), 0.1 * options.tilt_rate_rad_s + 1e-9);
  }
}

TEST(PlanPanTilt, ReportsSectionsWithoutView) {
  occ::PanTiltOptions options;
  options.min_lamps = 3;
  const occ::PanTiltResult result = occ::plan_pan_tilt(narrow_room(), four_lamp_route(1), options);
  EXPECT_EQ(result.status, occ::PlanStatus::blind);
  ASSERT_FALSE(result.gaps.empty());
  EXPECT_NE(result.message.find("3 lamps"), std::string::npos) << result.message;
  EXPECT_FALSE(result.plan.knots.empty());
}

TEST(PlanPanTilt, RejectsAGridThatItsAxesCannotFollow) {
  occ::PanTiltOptions options;
  options.pans = 5;
  EXPECT_NE(complaint([&] {
              occ::plan_pan_tilt(narrow_room(), four_lamp_route(1), options);
            }).find("pans"),
            std::string::npos);
  occ::PanTiltPlan plan;
  EXPECT_THROW(plan.validate(), std::invalid_argument);
}
