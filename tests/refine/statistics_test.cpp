// SPDX-License-Identifier: Apache-2.0
// Consistency of the refinement's covariance: normalised errors over many noisy images.
#include <cmath>
#include <limits>

#include "libocc/refine/refine.hpp"
#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

constexpr int images = 300;

Rigid3 truth() { return look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0}); }

struct Statistics {
  double pose_nees = 0;      ///< mean of e^T S^-1 e, 6 expected
  double position_nees = 0;  ///< 3 expected
  double error_ratio = 0;    ///< root mean square position error over what is stated
  double mean_chi2_per_dof = 0;
  double stated_sigma_m = 0;
  double mean_growth_px = 0;
};

Statistics over_images(const Scene& scene, const test::Measurement& measurement,
                       const RefineOptions& options, std::uint64_t seed = 1) {
  const std::vector<Blob> exact = test::exact_blobs(scene, truth(), measurement);
  Random random(seed);
  Statistics mean;
  double squared_error = 0, stated = 0;
  for (int i = 0; i < images; ++i) {
    const auto blobs = test::noisy(exact, scene, measurement, random);
    const auto refined = refine(truth(), test::in_order(scene), blobs, scene, options);
    EXPECT_TRUE(refined.ok()) << refined.message;
    const Vector6 error = difference(refined->cam_from_world, truth());
    const Eigen::Vector3d slip =
        refined->cam_from_world.origin_in_source() - truth().origin_in_source();
    const Eigen::Matrix3d position =
        position_covariance(refined->cam_from_world, refined->covariance);
    mean.pose_nees += test::nees(error, refined->covariance) / images;
    mean.position_nees += test::nees(slip, position) / images;
    mean.mean_chi2_per_dof += refined->chi2 / refined->dof / images;
    mean.mean_growth_px += refined->rim_growth_px.value_or(0) / images;
    squared_error += slip.squaredNorm();
    stated += position.trace();
  }
  mean.error_ratio = std::sqrt(squared_error / stated);
  mean.stated_sigma_m = std::sqrt(stated / images);
  return mean;
}

void expect_true_covariance(const Statistics& s) {
  const auto pose = test::chi2_interval(6.0 * images);
  EXPECT_GT(s.pose_nees * images, pose.first);
  EXPECT_LT(s.pose_nees * images, pose.second);
  const auto position = test::chi2_interval(3.0 * images);
  EXPECT_GT(s.position_nees * images, position.first);
  EXPECT_LT(s.position_nees * images, position.second);
  EXPECT_NEAR(s.error_ratio, 1, 0.1);
  EXPECT_NEAR(s.mean_chi2_per_dof, 1, 0.1);
}

Scene points_room() {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.shape = LampShape::point;
  return scene;
}

TEST(RefineCovariance, IsTrueForPoints) {
  expect_true_covariance(over_images(points_room(), {0, 0, 0.05}, {}));
}

// Sigmas five times too small show in the residuals; chance does not look like that.
TEST(RefineCovariance, IsTrueByItsVarianceFactorWhenSigmasAreNot) {
  const Scene scene = points_room();
  const test::Measurement measurement{0, 0, 0.25};
  const std::vector<Blob> exact = test::exact_blobs(scene, truth(), measurement);
  Random random(7);
  double squared_error = 0, stated = 0;
  int plain = 0;
  for (int i = 0; i < images; ++i) {
    auto blobs = test::noisy(exact, scene, measurement, random);
    const auto honest = refine(truth(), test::in_order(scene), blobs, scene);
    plain += honest->variance_factor == 1;
    for (Blob& blob : blobs) blob.covariance_px2 /= 25;
    RefineOptions options;
    options.huber_sigma = std::numeric_limits<double>::infinity();
    const auto refined = refine(truth(), test::in_order(scene), blobs, scene, options);
    squared_error +=
        (refined->cam_from_world.origin_in_source() - truth().origin_in_source()).squaredNorm();
    stated += position_covariance(refined->cam_from_world, refined->covariance).trace();
  }
  EXPECT_NEAR(std::sqrt(squared_error / stated), 1, 0.1);
  EXPECT_GE(plain, images - 3);
}

TEST(RefineCovariance, IsTrueForRims) {
  Scene scene = test::irregular_room();
  expect_true_covariance(over_images(scene, {40}, {}));
  scene.lamps[0].shape = scene.lamps[3].shape = LampShape::rectangle;
  scene.lamps[0].size_m = scene.lamps[3].size_m = {0.3, 0.12};
  expect_true_covariance(over_images(scene, {40}, {}, 2));
}

TEST(RefineCovariance, IsTrueWithFluxWhichHelps) {
  Scene scene = points_room();
  scene.lamps.resize(4);
  for (Lamp& lamp : scene.lamps) lamp.power_sigma = 0.01;
  const test::Measurement measurement{0, 0, 0.5, 0, 0, 0.005};
  RefineOptions options;
  const Statistics geometry = over_images(scene, measurement, options);
  options.flux = FluxModel::known_power;
  const Statistics known = over_images(scene, measurement, options);
  options.flux = FluxModel::common_factor;
  const Statistics factor = over_images(scene, measurement, options);
  for (const Statistics& s : {geometry, known, factor}) expect_true_covariance(s);
  EXPECT_LT(known.stated_sigma_m, 0.9 * geometry.stated_sigma_m);
  EXPECT_LT(factor.stated_sigma_m, geometry.stated_sigma_m);
  EXPECT_GT(factor.stated_sigma_m, known.stated_sigma_m);
}

TEST(RefineCovariance, IsTrueForRimsWithFlux) {
  RefineOptions options;
  options.flux = FluxModel::known_power;
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.power_sigma = 0.001;
  expect_true_covariance(over_images(scene, {40, 0.05, 0.03, 0, 0, 0.001}, options));
}

TEST(RefineCovariance, IsTrueWithAnErrorCommonToEachLamp) {
  RefineOptions options;
  options.model_sigma_px = 0.2;
  const test::Measurement measurement{40, 0.05, 0.03, 0.2};
  // Errors of map and lens also change the sizes of images, so that shifts alone are covered with
  // a margin (SceneErrors.ModelSigmaCoversWrongPositions).
  const Statistics shifted = over_images(test::irregular_room(), measurement, options);
  EXPECT_LT(shifted.pose_nees * images, test::chi2_interval(6.0 * images).second);
  EXPECT_GT(shifted.error_ratio, 0.8);
  EXPECT_LT(shifted.error_ratio, 1.1);
  expect_true_covariance(over_images(points_room(), {0, 0, 0.05, 0.2}, options, 2));
  // If that error is not stated, the variance factor of the lamps contains most of it: without it
  // the mean is above 50.
  RefineOptions unaware;
  unaware.huber_sigma = std::numeric_limits<double>::infinity();
  EXPECT_LT(over_images(test::irregular_room(), measurement, unaware).pose_nees, 15);
}

TEST(RefineCovariance, IsTrueWhenSaturatedRimsHaveGrown) {
  const Statistics s = over_images(test::irregular_room(), {40, 0.05, 0.03, 0, 1.5}, {});
  expect_true_covariance(s);
  EXPECT_NEAR(s.mean_growth_px, 1.5, 0.03);
}

TEST(RefineCovariance, IsTrueWithAPrior) {
  // the prior must vary like a measurement: a heading drawn anew for each image
  Scene scene = points_room();
  const test::Measurement measurement{0, 0, 1.0};
  const std::vector<Blob> exact = test::exact_blobs(scene, truth(), measurement);
  Random random(3);
  double nees = 0;
  for (int i = 0; i < images; ++i) {
    RefineOptions options;
    Prior& prior = options.prior.emplace();
    prior.heading_sigma_rad = 0.003;
    prior.heading_rad = heading_rad(truth()) + 0.003 * random.normal();
    prior.gravity_sigma_rad = 0.004;
    prior.gravity_in_cam = so3_exp(0.004 * test::random_vector(random)) * -truth().rotation.col(2);
    prior.position_sigma_m = 0.01;
    prior.position_m = truth().origin_in_source() + 0.01 * test::random_vector(random);
    const auto blobs = test::noisy(exact, scene, measurement, random);
    const auto refined = refine(truth(), test::in_order(scene), blobs, scene, options);
    ASSERT_TRUE(refined.ok());
    const Vector6 error = difference(refined->cam_from_world, truth());
    nees += test::nees(error, refined->covariance);
  }
  const auto interval = test::chi2_interval(6.0 * images);
  EXPECT_GT(nees, interval.first);
  EXPECT_LT(nees, interval.second);
}

}  // namespace
}  // namespace occ
