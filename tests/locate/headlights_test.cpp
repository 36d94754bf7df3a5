// SPDX-License-Identifier: Apache-2.0
// Cars by their lamps: the curve of distance against yaw, intervals that hold, honest refusals.
#include "libocc/locate/headlights.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "tests/support/support.hpp"

namespace occ::test {
namespace {

Camera road_camera() { return Camera::pinhole(1280, 960, 1200, 1200, 639.5, 479.5); }

// Camera frame: y down. The lamps' middle at (x, height, z), their line turned by `yaw` from the
// perpendicular of the line of sight.
struct Car {
  double x = 2, drop_m = 0.55, z = 20, yaw = 0.2, separation_m = 1.4;

  Eigen::Vector3d middle() const { return {x, drop_m, z}; }
  Eigen::Vector3d lamp(double side) const {
    const double turn = std::atan2(x, z) + yaw;
    return middle() +
           side * 0.5 * separation_m * Eigen::Vector3d(std::cos(turn), 0, -std::sin(turn));
  }
  Eigen::Matrix2d pixels(Random* random = nullptr, double sigma_px = 0) const {
    Eigen::Matrix2d px;
    for (int i = 0; i < 2; ++i) {
      px.col(i) = *road_camera().project(lamp(2 * i - 1));
      if (random) px.col(i) += sigma_px * Eigen::Vector2d(random->normal(), random->normal());
    }
    return px;
  }
};

TEST(Headlights, TheCurveHoldsTheTruthExactly) {
  HeadlightOptions options;
  options.separation_m = 1.4;
  options.yaw_max_rad = 1.2;
  for (const double yaw : {-1.0, -0.4, 0.0, 0.7}) {
    Car car;
    car.drop_m = 0;  // in the plane of the camera, where the yaw is that of the triangle
    car.yaw = yaw;
    const auto found = headlight_distance(car.pixels(), road_camera(), options);
    ASSERT_TRUE(found.ok());
    // The bisector is off the line to the middle by atan(tan^2(theta/2) tan(yaw)).
    double nearest = 1e9;
    for (std::size_t i = 0; i < found->yaw_rad.size(); ++i)
      if (std::abs(found->yaw_rad[i] - yaw) < 0.02)
        nearest = std::min(nearest, std::abs(found->distance_of_yaw_m[i] - car.middle().norm()));
    EXPECT_LT(nearest, 0.02 * car.middle().norm());
    EXPECT_NEAR(found->bearing_rad, std::atan2(car.x, car.z), 3e-3);
  }
}

TEST(Headlights, FacingTheCameraItIsTheTriangleOfTextbooks) {
  Car car;
  car.x = car.drop_m = car.yaw = 0;
  HeadlightOptions options;
  options.yaw_max_rad = 1e-6;
  options.separation_sigma_m = 1e-6;
  options.sigma_px = 1e-6;
  const auto found = headlight_distance(car.pixels(), road_camera(), options);
  EXPECT_NEAR(found->distance_m, 20, 1e-5);
  EXPECT_NEAR(found->low_m, 20, 1e-3);
  EXPECT_NEAR(found->separation_rad, 2 * std::atan(0.7 / 20), 1e-12);
}

struct Coverage {
  int trials = 0, held = 0;
  double width_m = 0;

  void add(const HeadlightDistance& found, double truth_m) {
    ++trials;
    held += truth_m >= found.low_m && truth_m <= found.high_m;
    width_m += found.high_m - found.low_m;
  }
  // Within 3.3 standard deviations of a binomial, 1 in 1000.
  bool holds(double probability = 0.95) const {
    const double sigma = std::sqrt(trials * probability * (1 - probability));
    return std::abs(held - probability * trials) < 3.3 * sigma;
  }
};

Coverage covered(const HeadlightOptions& options, int trials) {
  Coverage coverage;
  Random random(31);
  for (int t = 0; t < trials; ++t) {
    Car car;
    car.x = random.uniform(-5, 5);
    car.z = random.uniform(10, 40);
    car.separation_m = options.separation_m + options.separation_sigma_m * random.normal();
    do car.yaw = random.uniform(-options.yaw_max_rad, options.yaw_max_rad);
    while (random.uniform() > std::exp(options.yaw_concentration * (std::cos(car.yaw) - 1)));
    HeadlightOptions known = options;
    car.drop_m = 0.55;
    if (options.heights) {
      const RoadHeights& h = *options.heights;
      car.drop_m = h.camera_m - h.lamps_m + h.lamps_sigma_m * random.normal() +
                   h.camera_sigma_m * random.normal();
      known.heights->up_in_cam =
          so3_exp({h.up_sigma_rad * random.normal(), 0, h.up_sigma_rad * random.normal()}) *
          Eigen::Vector3d(0, -1, 0);
    }
    const auto found =
        headlight_distance(car.pixels(&random, options.sigma_px), road_camera(), known);
    EXPECT_TRUE(found.ok()) << found.message;
    coverage.add(*found, car.middle().norm());
  }
  coverage.width_m /= trials;
  return coverage;
}

TEST(Headlights, TheIntervalHoldsAsOftenAsItSays) {
  HeadlightOptions options;
  const Coverage uniform = covered(options, 1000);
  EXPECT_TRUE(uniform.holds()) << uniform.held;
  EXPECT_FALSE(uniform.holds(0.89)) << "a wrong probability must be noticed";
  options.yaw_concentration = 20;
  const Coverage peaked = covered(options, 1000);
  EXPECT_TRUE(peaked.holds()) << peaked.held;
  EXPECT_LT(peaked.width_m, uniform.width_m);
}

TEST(Headlights, HeightsMakeTheIntervalShorterAndItStillHolds) {
  HeadlightOptions options;
  options.yaw_max_rad = 1;
  const Coverage without = covered(options, 500);
  options.heights = RoadHeights();
  options.heights->lamps_sigma_m = 0.03;
  options.heights->up_sigma_rad = 0.001;
  const Coverage with = covered(options, 1000);
  EXPECT_TRUE(with.holds()) << with.held;
  EXPECT_LT(with.width_m, 0.8 * without.width_m);
}

TEST(Headlights, LampsAsHighAsTheCameraAddNothing) {
  Car car;
  car.drop_m = 0;
  HeadlightOptions options;
  const auto without = headlight_distance(car.pixels(), road_camera(), options);
  options.heights = RoadHeights();
  options.heights->lamps_m = options.heights->camera_m;
  const auto with = headlight_distance(car.pixels(), road_camera(), options);
  EXPECT_NEAR(with->high_m - with->low_m, without->high_m - without->low_m, 0.02 * without->low_m);
}

TEST(Headlights, WhatCannotBeIsRefused) {
  Eigen::Matrix2d px;
  px << 300, 300.5, 200, 200;
  auto found = headlight_distance(px, road_camera());
  EXPECT_EQ(found.status, Status::degenerate);
  EXPECT_LT(found->bearing_rad, 0);
  px.col(1) = px.col(0);
  found = headlight_distance(px, road_camera());
  EXPECT_EQ(found.status, Status::degenerate);
  EXPECT_TRUE(found->direction_in_cam.allFinite());
  HeadlightOptions options;
  options.heights = RoadHeights();
  Car car;
  car.drop_m = -3;  // lamps above the horizon, said to be below the camera
  EXPECT_EQ(headlight_distance(car.pixels(), road_camera(), options).status, Status::no_pose);
}

TEST(Headlights, TellTheCallersMistakes) {
  Eigen::Matrix2d px = Car().pixels();
  const auto said = [&](const HeadlightOptions& options) {
    return complaint([&] { headlight_distance(px, road_camera(), options); });
  };
  HeadlightOptions options;
  options.yaw_max_rad = 1.6;
  EXPECT_NE(said(options).find("yaw_max_rad"), std::string::npos);
  options = {};
  options.separation_m = 0;
  EXPECT_NE(said(options).find("separation_m must be positive, got 0"), std::string::npos);
  px(0, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(said({}).find("lamps_px[1]"), std::string::npos);
}

TEST(Headlights, WithoutAnyPoseTheReasonIsThatOfSolvePose) {
  Eigen::Matrix3Xd lamps(3, 3);
  lamps << 0, 0, 0, 0.7, -0.7, 0.1, 0, 0, 0;  // on a line
  Eigen::Matrix2Xd px(2, 3);
  px << 700, 600, 640, 400, 400, 400;
  const auto poses = vehicle_poses(lamps, px, road_camera(), 0.2);
  EXPECT_TRUE(poses->empty());
  EXPECT_EQ(poses.status, Status::degenerate) << poses.message;
}

TEST(Headlights, AThirdLampGivesTheFullAnswer) {
  Eigen::Matrix3Xd lamps(3, 3);  // and a lamp in the windscreen
  lamps << 0, 0, -1.2, 0.7, -0.7, 0.3, 0, 0, 0.7;
  Random random(33);
  int held = 0, found = 0;
  for (int t = 0; t < 200; ++t) {
    const double yaw = random.uniform(-0.6, 0.6), distance = random.uniform(6, 15);
    // x forward, towards the camera at yaw 0: cam z is against it.
    Eigen::Matrix3d facing;
    facing << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    const Rigid3 pose{facing * so3_exp({0, 0, yaw}), {0, 0.5, distance}};
    Eigen::Matrix2Xd px(2, 3);
    for (int i = 0; i < 3; ++i)
      px.col(i) = *road_camera().project(pose * Eigen::Vector3d(lamps.col(i))) +
                  0.2 * Eigen::Vector2d(random.normal(), random.normal());
    const auto poses = vehicle_poses(lamps, px, road_camera(), 0.2);
    bool any = false;
    for (const VehiclePose& vehicle : *poses)
      any = any || (std::abs(vehicle.distance_m - pose.translation.norm()) < 4 * vehicle.sigma_m &&
                    std::abs(vehicle.yaw_rad - yaw) < 4 * vehicle.yaw_sigma_rad);
    held += any;
    found += !poses->empty();
  }
  EXPECT_EQ(found, 200);
  EXPECT_GE(held, 195);
}

}  // namespace
}  // namespace occ::test
