// SPDX-License-Identifier: Apache-2.0
// Protection level of one image for the origin of a body, and how it follows the body.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/core/statistics.hpp"
#include "libocc/refine/internal/problem.hpp"
#include "libocc/track/internal/integrity_monitor.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ::internal::track {
namespace {

/// A camera on a vehicle, off its origin, that sees six lamps.
struct VehicleImage {
  Scene scene = test::irregular_room();
  PlanarPose body{2.0, 1.9, 0.7};
  Rigid3 cam_from_body = look_at({0.5, -0.3, 0.4}, {0.6, -0.2, 3}, {0.2, 1, 0});
  Rigid3 cam_from_world = cam_from_body * body_from_world(body);
  std::vector<Blob> blobs;
  Refined refined;
  Matrix6 mount = Matrix6::Zero();
  TrackerOptions options;

  VehicleImage() {
    test::Measurement m;
    m.centroid_sigma_px = 0.1;
    blobs = test::exact_blobs(scene, cam_from_world, m);
    RefineOptions refine_options;
    refine_options.rung = Rung::centres;
    refined =
        occ::refine(cam_from_world, test::in_order(scene), blobs, scene, refine_options).value;
    options.alert_limit_m = 0.1;
    options.floor.emplace();
    mount.diagonal() << 1e-8, 2e-8, 4e-8, 1e-8, 3e-8, 2e-8;
  }
  SingleImage image(double time_s = 0) const { return {time_s, refined, cam_from_body, mount}; }

  /// x and y of the body's origin, and its heading, after a change of the camera's pose.
  Eigen::VectorXd body_at(const Rigid3& pose) const {
    const PlanarPose moved = planar_pose(cam_from_body.inverse() * pose);
    return Eigen::Vector3d(moved.x_m, moved.y_m, moved.heading_rad);
  }
  /// Levels of these three numbers, by derivatives of finite differences.
  ProtectionLevel expected() const {
    SeparationModel model = refined.separation;
    Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
    for (const Lamp& lamp : scene.lamps) pivot += refined.cam_from_world * lamp.centre_m / 6;
    const refine::State state{refined.cam_from_world};
    model.position_jacobian.leftCols<6>() = test::numerical_jacobian(
        [&](const Eigen::VectorXd& step) {
          refine::Vector8 all = refine::Vector8::Zero();
          all.head<6>() = step;
          return body_at(moved(state, pivot, all).cam_from_world);
        },
        Vector6::Zero());
    const Eigen::MatrixXd by_pose = test::numerical_jacobian(
        [&](const Eigen::VectorXd& step) { return body_at(perturb(refined.cam_from_world, step)); },
        Vector6::Zero());
    model.position_covariance_m2 = by_pose * (refined.covariance + mount) * by_pose.transpose();
    model.fault_probability = options.locate.lamp_fault_probability;
    return protection_level(model, options.integrity_risk / 3).value;
  }
};

TEST(IntegrityLevel, IsThatOfTheBodysOrigin) {
  const VehicleImage vehicle;
  IntegrityMonitor monitor(vehicle.options);
  const Eigen::Vector2d at = vehicle.body.position();
  EXPECT_EQ(monitor.level_m(at, 0), infinity);
  EXPECT_EQ(monitor.since_s(), -infinity);
  EXPECT_EQ(monitor.add(vehicle.image(), at), "");
  EXPECT_EQ(monitor.since_s(), 0);
  const double level_m = vehicle.expected().horizontal_m;
  EXPECT_GT(level_m, 1e-4);
  EXPECT_LT(level_m, 0.2);
  EXPECT_NEAR(monitor.level_m(at, 0), level_m, 1e-5 * level_m);
  // The distance of the tracked position adds to it.
  EXPECT_NEAR(monitor.level_m(at + Eigen::Vector2d(0.03, -0.04), 0), level_m + 0.05, 1e-6);
  EXPECT_EQ(monitor.level_m(at, -0.1), infinity);
  monitor.clear();
  EXPECT_EQ(monitor.level_m(at, 0), infinity);
}

TEST(IntegrityLevel, GrowsWithTheWayByHeadingAndOdometry) {
  const VehicleImage vehicle;
  IntegrityMonitor monitor(vehicle.options);
  monitor.add(vehicle.image(), vehicle.body.position());
  const PlanarPose step{0.6, 0, 0};
  const double sigma_m = 2e-3;
  PlanarOdometry odometry{0, 1, step, Eigen::Matrix3d::Zero()};
  odometry.covariance.diagonal() << sigma_m * sigma_m, sigma_m * sigma_m, 1e-14;
  monitor.add(odometry);
  const Eigen::Vector2d there = (vehicle.body * step).position();
  const ProtectionLevel levels = vehicle.expected();
  // Two independent errors of this size exceed the radius with a third of the risk.
  const double radius_m = sigma_m * std::sqrt(-2 * std::log(vehicle.options.integrity_risk / 3));
  const double expected = levels.horizontal_m + 0.6 * levels.vertical_m + radius_m;
  EXPECT_NEAR(monitor.level_m(there, 1), expected, 2e-3 * expected);
  EXPECT_NEAR(monitor.level_m(there + Eigen::Vector2d(0, 0.01), 1), expected + 0.01,
              2e-3 * expected);
  // A later image with a smaller bound is used, one with a larger bound is not.
  VehicleImage later;
  later.body = vehicle.body * step;
  later.cam_from_world = later.cam_from_body * body_from_world(later.body);
  later.refined.cam_from_world = later.cam_from_world;
  EXPECT_EQ(monitor.add(later.image(1), there + Eigen::Vector2d(0.05, 0)), "");
  EXPECT_EQ(monitor.since_s(), 1);
  IntegrityMonitor other(vehicle.options);
  other.add(vehicle.image(), vehicle.body.position());
  other.add(odometry);
  later.refined.separation.position_jacobian *= 1e3;
  later.mount *= 1e9;
  later.refined.covariance *= 1e6;
  EXPECT_EQ(other.add(later.image(1), there), "");
  EXPECT_EQ(other.since_s(), 0);
}

TEST(IntegrityLevel, IsUnknownIfLampsContradictOrAreTooFew) {
  VehicleImage vehicle;
  vehicle.refined.separation.lamps.resize(2);
  IntegrityMonitor monitor(vehicle.options);
  const Eigen::Vector2d at = vehicle.body.position();
  EXPECT_EQ(monitor.add(vehicle.image(), at), "");
  EXPECT_EQ(monitor.level_m(at, 0), infinity);
  VehicleImage contradicting;
  contradicting.refined.separation.lamps[2].gradient *= 0;
  contradicting.refined.separation.lamps[2].gradient[3] = 1e6;
  EXPECT_NE(monitor.add(contradicting.image(), at), "");
  EXPECT_EQ(monitor.level_m(at, 0), infinity);
}

}  // namespace
}  // namespace occ::internal::track
