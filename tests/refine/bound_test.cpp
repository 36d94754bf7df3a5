// SPDX-License-Identifier: Apache-2.0
// The Cramer-Rao bound of the pose: closed forms, Monte Carlo, invariance, what it refuses.
#include "libocc/refine/bound.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "tests/support/measured_blobs.hpp"
#include "tests/support/nees.hpp"

namespace occ {
namespace {

Rigid3 truth() { return look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0}); }

std::vector<Eigen::Vector3d> centres(const Scene& scene) {
  std::vector<Eigen::Vector3d> points;
  for (const Lamp& lamp : scene.lamps) points.push_back(lamp.centre_m);
  return points;
}

/// J^T J / sigma^2 by central differences of the projection, inverted.
Matrix6 numerical_bound(const std::vector<Eigen::Vector3d>& points, const Camera& camera,
                        double sigma_px) {
  const auto project = [&](const Eigen::VectorXd& delta) -> Eigen::VectorXd {
    Eigen::VectorXd px(2 * static_cast<Eigen::Index>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
      px.segment<2>(2 * static_cast<Eigen::Index>(i)) =
          camera.project(perturb(truth(), delta) * points[i]).value();
    return px;
  };
  const Eigen::MatrixXd j = test::numerical_jacobian(project, Eigen::VectorXd::Zero(6));
  return sigma_px * sigma_px * (j.transpose() * j).inverse();
}

TEST(PoseBound, OfPointsIsTheInverseOfTheirInformation) {
  const Scene scene = test::irregular_room();
  const Camera bent = Camera::pinhole(640, 480, 422.5, 420, 319.5, 239.5, {-0.2, 0.05, 0, 0});
  for (const Camera& camera : {scene.camera, bent}) {
    const auto bound = pose_bound(centres(scene), camera, truth(), 0.3);
    ASSERT_TRUE(bound.ok()) << bound.message;
    const Matrix6 expected = numerical_bound(centres(scene), camera, 0.3);
    EXPECT_TRUE(test::jacobian_agrees(bound->covariance, expected, 1e-5));
    EXPECT_FALSE(test::jacobian_agrees(1.001 * bound->covariance, expected, 1e-5));
    EXPECT_TRUE(test::jacobian_agrees(bound->position_covariance_m2,
                                      position_covariance(truth(), bound->covariance), 1e-12));
    EXPECT_EQ(bound->lamps, 6);
    EXPECT_EQ(bound->rank, 6);
  }
}

TEST(PoseBound, WeighsPointsByTheirSigmas) {
  const Scene scene = test::irregular_room();
  auto points = centres(scene);
  std::vector<double> sigmas(points.size(), 0.3);
  const auto once = pose_bound(points, scene.camera, truth(), sigmas);
  points.push_back(points[0]);  // seen twice: half the variance
  sigmas.push_back(0.3);
  const auto twice = pose_bound(points, scene.camera, truth(), sigmas);
  points.pop_back();
  sigmas.pop_back();
  sigmas[0] /= std::sqrt(2.0);
  const auto better = pose_bound(points, scene.camera, truth(), sigmas);
  EXPECT_TRUE(test::jacobian_agrees(twice->covariance, better->covariance, 1e-9));
  EXPECT_LT(better->covariance.trace(), once->covariance.trace());
}

TEST(PoseBound, OfObservationsIsTheRefinementsCovariance) {
  const Scene scene = test::irregular_room();
  for (const Rung rung : {Rung::centres, Rung::rims}) {
    RefineOptions options;
    options.rung = rung;
    options.model_sigma_px = 0.02;
    const auto blobs = test::exact_blobs(scene, truth(), {48});
    const auto refined = refine(truth(), test::in_order(scene), blobs, scene, options);
    const auto bound = pose_bound(test::in_order(scene), blobs, scene, truth(), options);
    ASSERT_TRUE(bound.ok()) << bound.message;
    EXPECT_TRUE(test::jacobian_agrees(bound->covariance, refined->covariance, 1e-5));
  }
}

/// Errors of the refinement over the bound of what it was given: one, up to chance.
TEST(PoseBound, IsAttainedByEveryRungOfTheRefinement) {
  const Scene scene = test::irregular_room();
  Scene points = scene;
  for (Lamp& lamp : points.lamps) lamp.shape = LampShape::point;
  struct Case {
    const Scene& scene;
    Rung rung;
  };
  for (const Case& c :
       {Case{points, Rung::points}, Case{scene, Rung::centres}, Case{scene, Rung::rims}}) {
    RefineOptions options;
    options.rung = c.rung;
    options.huber_sigma = std::numeric_limits<double>::infinity();
    const test::Measurement measurement{c.rung == Rung::rims ? 40 : 0};
    const auto exact = test::exact_blobs(c.scene, truth(), measurement);
    const auto matches = test::in_order(c.scene);
    const auto bound = pose_bound(matches, exact, c.scene, truth(), options);
    ASSERT_TRUE(bound.ok());
    Random random(1);
    double nees = 0;
    constexpr int images = 400;
    for (int i = 0; i < images; ++i) {
      const auto blobs = test::noisy(exact, c.scene, measurement, random);
      const auto refined = refine(truth(), matches, blobs, c.scene, options);
      const Vector6 error = difference(refined->cam_from_world, truth());
      nees += test::nees(error, bound->covariance);
    }
    const auto interval = test::chi2_interval(6.0 * images);
    EXPECT_GT(nees, interval.first);
    EXPECT_LT(nees, interval.second);
  }
}

TEST(PoseBound, OfAScenePrefersTheDearerRung) {
  const Scene scene = test::irregular_room();
  double before = std::numeric_limits<double>::infinity();
  for (const Rung rung : {Rung::centres, Rung::rims, Rung::direct}) {
    const auto bound = pose_bound(scene, truth(), rung);
    ASSERT_TRUE(bound.ok()) << bound.message;
    const double sigma = std::sqrt(bound->position_covariance_m2.trace());
    EXPECT_LT(sigma, 1.01 * before);
    EXPECT_GT(sigma, 2e-5);
    before = sigma;
  }
  const auto points = pose_bound(scene, truth(), Rung::points);
  const auto images = pose_bound(scene, truth(), Rung::centres);
  EXPECT_NEAR(points->covariance.trace(), images->covariance.trace(),
              0.01 * images->covariance.trace());
}

/// A round disc's edge, its light known: radius and place by the one-dimensional edge integral
/// agree with the sum over its pixels, in which light and background are found from the disc.
TEST(PoseBound, RimsAndPixelsAgreeOnALargeDisc) {
  Scene scene = test::irregular_room();
  for (Lamp& lamp : scene.lamps) lamp.radius_m *= 1.5;
  const double rims = pose_bound(scene, truth(), Rung::rims)->covariance.trace();
  const double pixels = pose_bound(scene, truth(), Rung::direct)->covariance.trace();
  EXPECT_NEAR(rims / pixels, 1, 0.05);
}

TEST(PoseBound, FallsWithLightAndRisesWithBlur) {
  const Scene scene = test::irregular_room();
  for (const Rung rung : {Rung::centres, Rung::rims, Rung::direct}) {
    const double plain = pose_bound(scene, truth(), rung)->covariance.trace();
    Scene dim = scene, blurred = scene, noisy = scene;
    dim.sensor.exposure_s /= 2;
    blurred.sensor.psf_sigma_px *= 2;
    noisy.sensor.read_noise_e *= 5;
    for (const Scene& worse : {dim, blurred, noisy})
      EXPECT_GT(pose_bound(worse, truth(), rung)->covariance.trace(), 1.05 * plain);
  }
}

TEST(PoseBound, KnownPowersHelpSpotsMost) {
  Scene scene = test::irregular_room();
  scene.lamps.resize(4);
  for (Lamp& lamp : scene.lamps) {
    lamp.shape = LampShape::point;
    lamp.power_w = 0.02;
    lamp.power_sigma = 1e-3;
  }
  for (const Rung rung : {Rung::centres, Rung::direct}) {
    const double none = pose_bound(scene, truth(), rung)->covariance.trace();
    const double factor =
        pose_bound(scene, truth(), rung, FluxModel::common_factor)->covariance.trace();
    const double known =
        pose_bound(scene, truth(), rung, FluxModel::known_power)->covariance.trace();
    EXPECT_LT(known, factor);
    EXPECT_LT(factor, none);
  }
}

TEST(PoseBound, LeavesOutWhatIsNotInTheImage) {
  Scene scene = test::irregular_room();
  const auto six = pose_bound(scene, truth(), Rung::direct);
  Lamp away = scene.lamps[0], dark = scene.lamps[1];
  away.id = 10;
  away.centre_m = {30, 0, 3};
  dark.id = 11;
  dark.centre_m.x() -= 0.4;
  dark.normal = Eigen::Vector3d::UnitZ();
  scene.lamps.push_back(away);
  scene.lamps.push_back(dark);
  const auto same = pose_bound(scene, truth(), Rung::direct);
  EXPECT_EQ(same->lamps, six->lamps);
  EXPECT_TRUE(test::jacobian_agrees(same->covariance, six->covariance, 1e-6));
}

TEST(PoseBound, SaysWhenThereIsNone) {
  const Scene scene = test::irregular_room();
  const std::vector<Eigen::Vector3d> two = {{1, 1, 3}, {2, 1, 3}};
  const auto few = pose_bound(two, scene.camera, truth(), 0.1);
  EXPECT_EQ(few.status, Status::too_few_lamps);
  EXPECT_EQ(few->rank, 4);
  EXPECT_TRUE(few->covariance.diagonal().array().isInf().all());
  const std::vector<Eigen::Vector3d> line = {{1, 1, 3}, {2, 1, 3}, {3, 1, 3}, {1.5, 1, 3}};
  const auto collinear = pose_bound(line, scene.camera, truth(), 0.1);
  EXPECT_EQ(collinear.status, Status::degenerate);
  EXPECT_EQ(collinear->rank, 5);
  EXPECT_NE(collinear.message.find("5 of the pose's 6"), std::string::npos);
  EXPECT_EQ(pose_bound({}, scene.camera, truth(), 0.1).status, Status::too_few_lamps);
  const Rigid3 away = look_at({2, 2, 0.5}, {2, 2, -1}, Eigen::Vector3d::UnitX());
  for (const Rung rung : {Rung::points, Rung::centres, Rung::rims, Rung::direct}) {
    const auto none = pose_bound(scene, away, rung);
    EXPECT_EQ(none.status, Status::too_few_lamps);
    EXPECT_EQ(none->lamps, 0);
    EXPECT_TRUE(none->covariance.diagonal().array().isInf().all());
  }
}

TEST(PoseBound, RefusesBadInput) {
  const Scene scene = test::irregular_room();
  const auto points = centres(scene);
  const auto says = [](const std::function<void()>& call, const char* what) {
    return test::complaint(call).find(what) != std::string::npos;
  };
  EXPECT_TRUE(says([&] { pose_bound(points, scene.camera, truth(), 0); }, "sigmas_px[0]"));
  EXPECT_TRUE(says([&] { pose_bound(points, scene.camera, truth(), {0.1, 0.1}); }, "sigmas_px"));
  auto bad = points;
  bad[2].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(says([&] { pose_bound(bad, scene.camera, truth(), 0.1); }, "points_in_world[2]"));
  Rigid3 pose = truth();
  pose.translation.x() = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(says([&] { pose_bound(points, scene.camera, pose, 0.1); }, "cam_from_world"));
  EXPECT_TRUE(says([&] { pose_bound(scene, pose); }, "cam_from_world"));
  Scene broken = scene;
  broken.sensor.psf_sigma_px = -1;
  EXPECT_TRUE(says([&] { pose_bound(broken, truth()); }, "psf_sigma_px"));
}

}  // namespace
}  // namespace occ
