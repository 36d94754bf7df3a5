// SPDX-License-Identifier: Apache-2.0
// Errors of centroids and rims by the light of the lamps.
#include "libocc/refine/internal/light_errors.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "libocc/refine/internal/emission.hpp"
#include "tests/support/measured_blobs.hpp"

namespace occ {
using namespace internal::refine;
namespace {

/// Large discs without measured rims, seen obliquely.
struct SpotRoom {
  Scene scene = test::irregular_room();
  Rigid3 pose = look_at({2.1, 1.8, 1.2}, {2.5, 2.1, 3}, {0.2, 1, 0});
  std::vector<Blob> blobs;
  std::vector<Match> matches = test::in_order(scene);

  SpotRoom() {
    for (Lamp& lamp : scene.lamps) lamp.radius_m = 0.25;
    blobs = test::exact_blobs(scene, pose, {});
    for (Blob& blob : blobs) blob.ellipse.semi_minor_px = 20;
  }

  std::optional<std::vector<Blob>> widened() const {
    return with_errors_of_light(pose, matches, blobs, scene);
  }
  /// Lamp's centre minus the centre of its image.
  Eigen::Vector2d offset_px(int lamp) const {
    return *scene.camera.project(pose * scene.lamps[lamp].centre_m) -
           *project_lamp_centre(scene.lamps[lamp], pose, scene.camera);
  }
  Eigen::Vector2d shift_px(int lamp) const {
    const auto centre = scene.camera.project(pose * scene.lamps[lamp].centre_m);
    return blobs[lamp].light_response_px2 *
           log_irradiance_gradient(scene.lamps[lamp], pose, scene.camera, scene.sensor, *centre);
  }
};

TEST(ErrorsOfLight, AreCommonToAllLargeLampsWithoutARim) {
  const SpotRoom room;
  const auto widened = room.widened();
  ASSERT_TRUE(widened);
  const double lamps = 6;
  for (int i = 0; i < 6; ++i) {
    const Eigen::Matrix2d added = (*widened)[i].covariance_px2 - room.blobs[i].covariance_px2;
    const Eigen::Vector2d along = room.offset_px(i).normalized();
    const Eigen::Vector2d across(-along.y(), along.x());
    // The mean of n independent errors with n times the variance has the variance of a common one.
    const double sigma_px = std::sqrt(along.dot(added * along) / lamps);
    const double sigmas = room.offset_px(i).norm() / sigma_px;
    EXPECT_GT(sigmas, 1.5) << "the light's centre is rather in the image's centre";
    EXPECT_LT(sigmas, 3.5) << "but may be the lamp's centre";
    EXPECT_LT((added * across).norm(), 1e-9 * added.norm());
  }
}

TEST(ErrorsOfLight, ContainThePredictedShiftByTheGradient) {
  SpotRoom room;
  room.matches = {{2, 2}};
  const auto without = room.widened();
  room.blobs[2].light_response_px2 << 30, 4, 4, 25;
  const auto widened = room.widened();
  ASSERT_TRUE(without && widened);
  const Eigen::Vector2d shift = room.shift_px(2);
  EXPECT_GT(shift.norm(), 1e-3);
  const Eigen::Matrix2d added = (*widened)[2].covariance_px2 - (*without)[2].covariance_px2;
  EXPECT_LT((added - shift * shift.transpose()).norm(), 1e-9 * added.norm());
}

TEST(ErrorsOfLight, DoNotConcernOtherLamps) {
  SpotRoom room;
  room.blobs[0].rim = test::exact_rim(room.scene.lamps[0], room.pose, room.scene.camera, 8, 0.05);
  room.blobs[1].ellipse.semi_minor_px = 4;  // a spot, whose centroid is that of the light
  room.blobs[2].striped = true;
  room.scene.lamps[3].shape = LampShape::point;
  room.scene.lamps[4].normal = Eigen::Vector3d::UnitZ();  // dark side
  EXPECT_TRUE(room.widened());
  room.matches = {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {4, 4}};
  EXPECT_FALSE(room.widened());
  room.matches = {{5, 5}, {6, 5}, {5, 6}};  // two are outside their lists
  ASSERT_TRUE(room.widened());
  EXPECT_EQ(room.widened()->size(), 6u);
  const Eigen::Matrix2d alone = (*room.widened())[5].covariance_px2;
  room.blobs[4].ellipse.semi_minor_px = 6;
  room.scene.lamps[4].normal = -Eigen::Vector3d::UnitZ();
  room.matches = {{5, 5}, {4, 4}};
  const Eigen::Matrix2d start = room.blobs[5].covariance_px2;
  const Eigen::Matrix2d both = (*room.widened())[5].covariance_px2;
  EXPECT_LT((both - start - 2 * (alone - start)).norm(), 1e-9);
}

TEST(LightGradient, IsRemovedFromOverExposedRims) {
  SpotRoom room;
  EXPECT_FALSE(without_light_gradient(room.pose, room.matches, room.blobs, room.scene));
  for (const int i : {1, 4}) {
    room.blobs[i].rim = test::exact_rim(room.scene.lamps[i], room.pose, room.scene.camera, 8, 0.05);
    room.blobs[i].light_response_px2 << 30, 4, 4, 25;
  }
  room.blobs[4].saturated = true;
  room.blobs[5].saturated = true;
  const auto moved = without_light_gradient(room.pose, room.matches, room.blobs, room.scene);
  ASSERT_TRUE(moved);
  const Eigen::Vector2d shift = room.shift_px(4);
  EXPECT_GT(shift.norm(), 1e-3);
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector2d expected = i == 4 ? shift : Eigen::Vector2d::Zero();
    const Blob &before = room.blobs[i], &after = (*moved)[i];
    EXPECT_LT((after.centroid_px - before.centroid_px - expected).norm(), 1e-12) << i;
    for (std::size_t k = 0; k < before.rim.size(); ++k)
      EXPECT_LT((after.rim[k].px - before.rim[k].px - expected).norm(), 1e-12) << i;
  }
}

TEST(PoseError, IsAddedToCovarianceAndInformation) {
  Random random(5, 0);
  Eigen::Matrix<double, 9, 6> rows;
  for (Eigen::Index i = 0; i < rows.size(); ++i) rows.data()[i] = random.normal();
  Vector6 error;
  for (double& value : error) value = random.normal();
  Refined refined;
  refined.lamp_information = rows.transpose() * rows;
  refined.covariance = refined.lamp_information.inverse();
  const Matrix6 expected = refined.covariance + error * error.transpose();
  add_pose_error(error, refined);
  EXPECT_LT((refined.covariance - expected).norm(), 1e-12 * expected.norm());
  EXPECT_LT((refined.lamp_information * expected - Matrix6::Identity()).norm(), 1e-9);
}

double log_cos_emission(const Lamp& lamp, const Rigid3& pose, const Eigen::Vector2d& px) {
  const Eigen::Vector3d ray((px.x() - 319.5) / 422.5, (px.y() - 239.5) / 422.5, 1);
  return std::log(-ray.normalized().dot(pose.rotation * lamp.normal));
}

TEST(EmissionSlope, IsTheLogarithmOfTheCosineRelativeToTheCentre) {
  const SpotRoom room;
  Lamp lamp = room.scene.lamps[1];
  lamp.normal = Eigen::Vector3d(0.3, -0.2, -1).normalized();
  const Eigen::Vector2d centre = *room.scene.camera.project(room.pose * lamp.centre_m);
  const Eigen::Vector2d reach(40, 25);
  const EmissionSlope slope(lamp, room.pose, room.scene.camera, centre, reach);
  const auto truth = [&](double u, double v) {
    const Eigen::Vector2d px = centre + reach.cwiseProduct(Eigen::Vector2d(u, v));
    return log_cos_emission(lamp, room.pose, px) - log_cos_emission(lamp, room.pose, centre);
  };
  const auto found = [&](double u, double v) {
    return slope.at(centre.x() + u * reach.x(), centre.y() + v * reach.y());
  };
  EXPECT_EQ(found(0, 0), 0);
  for (const int side : {-1, 1}) {
    EXPECT_NEAR(found(side, 0), truth(side, 0), 1e-12);
    EXPECT_NEAR(found(0, side), truth(0, side), 1e-12);
  }
  const auto cross = [](const auto& f) { return f(1, 1) - f(1, -1) - f(-1, 1) + f(-1, -1); };
  EXPECT_GT(std::abs(cross(truth)), 1e-3);
  EXPECT_NEAR(cross(found), cross(truth), 1e-12);
  for (const double u : {-0.7, 0.4})
    for (const double v : {-0.5, 0.8})
      EXPECT_NEAR(found(u, v), truth(u, v), 0.02 * std::abs(truth(1, 1)) + 1e-4);
}

TEST(EmissionSlope, IsZeroWhereAPartOfTheImageIsDark) {
  const SpotRoom room;
  Lamp lamp = room.scene.lamps[1];
  const Eigen::Vector3d ray = (room.pose * lamp.centre_m).normalized();
  const Eigen::Vector2d centre = *room.scene.camera.project(room.pose * lamp.centre_m);
  const Eigen::Vector3d sideways = ray.unitOrthogonal();
  lamp.normal = room.pose.rotation.transpose() * (sideways - 0.02 * ray).normalized();
  const Eigen::Vector2d reach(40, 25);
  const EmissionSlope dark(lamp, room.pose, room.scene.camera, centre, reach);
  EXPECT_EQ(dark.at(centre.x() + 10, centre.y() - 7), 0);
  lamp.normal = room.pose.rotation.transpose() * (sideways - 0.5 * ray).normalized();
  const EmissionSlope lit(lamp, room.pose, room.scene.camera, centre, reach);
  EXPECT_NE(lit.at(centre.x() + 10, centre.y() - 7), 0);
}

TEST(ChangeOfOrder, KeepsTheLightTowardsTheReference) {
  const SpotRoom room;
  Lamp lamp = room.scene.lamps[1];
  lamp.normal = Eigen::Vector3d(0.3, -0.2, -1).normalized();
  // Generalised Lambertian emitter: P (m + 1) / (2 pi) cos^m.
  const double cos_emission =
      -(room.pose * lamp.centre_m).normalized().dot(room.pose.rotation * lamp.normal);
  const auto intensity = [&](const Lamp& of, double order) {
    return of.power_w * (order + 1) * std::pow(cos_emission, order);
  };
  for (const double order : {0.6, 1.7, 4.0}) {
    Lamp changed = lamp;
    change_order(lamp, order, room.pose, changed);
    EXPECT_NEAR(changed.order(), order, 1e-9);
    EXPECT_NEAR(intensity(changed, order), intensity(lamp, lamp.order()), 1e-9);
  }
  Lamp away = lamp;
  away.normal = -lamp.normal;
  Lamp changed = away;
  change_order(away, 3, room.pose, changed);
  EXPECT_EQ(changed.power_w, away.power_w);
  EXPECT_EQ(changed.half_power_rad, away.half_power_rad);
}

}  // namespace
}  // namespace occ
