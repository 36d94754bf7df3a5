// SPDX-License-Identifier: Apache-2.0
// The refinement's normal equations, against central differences of its own cost.
#include "libocc/refine/internal/problem.hpp"

#include <limits>

#include "tests/support/measured_blobs.hpp"

namespace occ {
using namespace internal::refine;
namespace {

Rigid3 truth() { return look_at({2.1, 1.8, 0.5}, {2.3, 2.1, 3.0}, {0.2, 1, 0}); }

/// Two discs by rim (one saturated), a rectangle by rim, a point, a disc cut by the border.
struct Everything {
  Scene scene = test::irregular_room();
  std::vector<Blob> blobs;
  RefineOptions options;

  explicit Everything(double growth = 1.3) : growth_px(growth) {
    scene.camera = Camera::pinhole(640, 480, 422.5, 420, 319.5, 239.5, {-0.22, 0.06, 1e-3, -8e-4});
    scene.lamps[1].shape = LampShape::rectangle;
    scene.lamps[1].size_m = {0.3, 0.12};
    scene.lamps[2].shape = LampShape::point;
    scene.lamps[3].normal = Eigen::Vector3d(-0.2, 0.3, -1);
    scene.validate();
    blobs = test::exact_blobs(scene, truth(), {24, 0.05, 0.03, 0, 0, 0.02});
    blobs[0].saturated = true;
    for (RimPoint& point : blobs[0].rim) point.px += growth_px * point.normal;
    blobs[3].cut_by_border = true;
    blobs[3].rim.resize(15);
    blobs[4].rim.clear();
    options.huber_sigma = std::numeric_limits<double>::infinity();
    options.model_sigma_px = 0.1;
    options.flux = FluxModel::common_factor;
    Prior& prior = options.prior.emplace();
    prior.position_m = truth().origin_in_source();
    prior.heading_rad = heading_rad(truth());
    prior.gravity_in_cam = -truth().rotation.col(2);
  }

  Observations observations() const {
    return observe(test::in_order(scene), blobs, scene, options);
  }
  State exact() const { return {truth(), growth_px, 0}; }

  double growth_px;
};

/// Off by a pixel or two in everything.
State off(const State& exact) {
  Vector8 step;
  step << 0.004, -0.003, 0.005, 0.004, 0.006, -0.003, 0.4, 0.2;
  return moved(exact, Eigen::Vector3d::Zero(), step);
}

TEST(RefineProblem, GradientAgreesWithDifferencesAndAWrongOneIsRefused) {
  const Everything all;
  const Observations observations = all.observations();
  for (const Rung rung : {Rung::points, Rung::centres, Rung::rims}) {
    RefineProblem problem(observations, all.scene, all.options, rung);
    const State state = off(all.exact());
    const Eigen::Vector3d pivot = problem.pivot(state);
    PoseNormalEquations normal;
    ASSERT_TRUE(problem.linearise(state, pivot, normal));
    EXPECT_NEAR(problem.chi2(state), normal.chi2, 1e-9 * normal.chi2);
    EXPECT_NEAR(normal.robust_chi2, normal.chi2, 1e-9 * normal.chi2);
    const auto half_chi2 = [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
      return Eigen::VectorXd::Constant(1, problem.chi2(moved(state, pivot, step)) / 2);
    };
    const Eigen::MatrixXd numeric =
        test::numerical_jacobian(half_chi2, Eigen::VectorXd::Zero(8), 1e-6);
    for (int i = 0; i < 8; ++i) {  // one by one: their scales differ by a thousand
      EXPECT_TRUE(test::jacobian_agrees(normal.gradient.segment<1>(i), numeric.col(i), 2e-6)) << i;
    }
    PoseNormalEquations about_the_camera;  // forgets to centre
    ASSERT_TRUE(problem.linearise(state, Eigen::Vector3d::Zero(), about_the_camera));
    EXPECT_FALSE(test::jacobian_agrees(about_the_camera.gradient.transpose(), numeric));
  }
}

TEST(RefineProblem, InformationIsTheHessianWhereResidualsVanish) {
  const Everything all(0);
  const Observations observations = all.observations();
  for (const Rung rung : {Rung::centres, Rung::rims}) {
    RefineProblem problem(observations, all.scene, all.options, rung);
    const State state = all.exact();
    const Eigen::Vector3d pivot = problem.pivot(state);
    PoseNormalEquations normal;
    ASSERT_TRUE(problem.linearise(state, pivot, normal));
    const auto gradient = [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
      PoseNormalEquations there;
      problem.linearise(moved(state, pivot, step), pivot + step.segment<3>(3), there);
      return there.gradient;
    };
    const Eigen::MatrixXd hessian =
        test::numerical_jacobian(gradient, Eigen::VectorXd::Zero(8), 1e-6);
    for (int i = 0; i < 8; ++i) {
      EXPECT_TRUE(test::jacobian_agrees(normal.information.col(i), hessian.col(i), 1e-5)) << i;
    }
    RefineOptions options = all.options;
    options.model_sigma_px = 0;
    const Observations stiff = observe(test::in_order(all.scene), all.blobs, all.scene, options);
    RefineProblem stiff_problem(stiff, all.scene, options, rung);
    ASSERT_TRUE(stiff_problem.linearise(state, pivot, normal));
    EXPECT_FALSE(test::jacobian_agrees(normal.information, hessian, 1e-2));
  }
}

/// Compares the eliminated errors common to one lamp (growth, shift, stretch) with five unknowns
/// that are carried along.
TEST(RefineProblem, EliminatedUnknownsEqualExplicitOnes) {
  Everything all;
  all.scene.lamps.resize(1);
  all.blobs.resize(1);
  all.blobs[0].ellipse.semi_minor_px = 20;  // which limits how far the rim may be moved
  RimErrorCovariance& common = all.blobs[0].rim_covariance_px2;
  common.topLeftCorner<3, 3>() << 0.04, 0.01, 0.02, 0.01, 0.03, -0.01, 0.02, -0.01, 0.05;
  common.bottomRightCorner<2, 2>() << 0.02, 0.01, 0.01, 0.03;
  common(0, 3) = common(3, 0) = 0.01;
  all.options.flux = FluxModel::ignore;
  all.options.prior.reset();
  Observations observations = all.observations();
  const double moved_px = 1.3;
  EXPECT_TRUE(observations.move_rims(moved_px, all.scene.camera));
  EXPECT_FALSE(observations.move_rims(1.4, all.scene.camera));
  RefineProblem problem(observations, all.scene, all.options, Rung::rims);
  const State state = {perturb(truth(), Vector6::Constant(1e-3)), 0.4};
  PoseNormalEquations normal;
  ASSERT_TRUE(problem.linearise(state, Eigen::Vector3d::Zero(), normal));

  const auto n = static_cast<Eigen::Index>(observations.rim.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(n + 1, 12);  // pose, common growth, own errors
  Eigen::VectorXd residuals = Eigen::VectorXd::Zero(n + 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const RimObservation& point = observations.rim[i];
    Eigen::Matrix<double, 1, 6> d_pose;
    const auto distance =
        rim_distance_px(all.scene.lamps[0], state.cam_from_world, point.ray, &d_pose);
    residuals[i] = point.inverse_sigma * (distance.value() + moved_px - state.growth_px);
    const Eigen::Vector2d& m = point.normal;
    rows.row(i) << d_pose, -1, -1, -m.transpose(), m.y() * m.y() - m.x() * m.x(),
        -2 * m.x() * m.y();
    rows.row(i) *= point.inverse_sigma;
  }
  const double growth_sigma_px = 2, own_growth_sigma_px = 0.3;
  rows(n, 6) = 1 / growth_sigma_px;
  residuals[n] = state.growth_px / growth_sigma_px;
  const Eigen::Vector3d own_sigma(own_growth_sigma_px, all.options.model_sigma_px,
                                  all.options.model_sigma_px);
  RimErrorCovariance own_covariance = common;
  own_covariance.diagonal().head<3>() += own_sigma.cwiseAbs2();
  Eigen::MatrixXd information = rows.transpose() * rows;
  information.bottomRightCorner<5, 5>() += own_covariance.inverse();
  const Eigen::VectorXd gradient = rows.transpose() * residuals;
  const RimErrorCovariance own = information.bottomRightCorner<5, 5>();
  const Eigen::MatrixXd gain = information.topRightCorner<7, 5>() * own.inverse();
  const Eigen::MatrixXd expected =
      information.topLeftCorner<7, 7>() - gain * information.bottomLeftCorner<5, 7>();
  const Eigen::VectorXd expected_gradient = gradient.head<7>() - gain * gradient.tail<5>();
  EXPECT_TRUE(test::jacobian_agrees(normal.information.topLeftCorner<7, 7>(), expected, 1e-9));
  EXPECT_TRUE(test::jacobian_agrees(normal.gradient.head<7>(), expected_gradient, 1e-9));
}

TEST(RefineProblem, PriorsRowsSumToItsChi2EvenWhereItTurnsAround) {
  Everything all;
  all.scene.lamps.clear();
  all.blobs.clear();
  all.options.flux = FluxModel::ignore;
  const Observations observations = all.observations();
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    Prior& prior = *all.options.prior;
    prior.heading_rad = random.uniform(-9, 9);
    prior.gravity_in_cam = test::random_vector(random).normalized();
    prior.position_sigmas_m = Eigen::Vector3d(0.1, 0.5, 2);
    prior.height_m = random.uniform(-2, 2);
    prior.last_pose = PriorPose{test::random_pose(random), 0.1 * Matrix6::Identity()};
    prior.last_pose->covariance(1, 4) = prior.last_pose->covariance(4, 1) = 0.05;
    RefineProblem problem(observations, all.scene, all.options, Rung::rims);
    const State state = {test::random_pose(random)};
    PoseNormalEquations normal;
    ASSERT_TRUE(problem.linearise(state, Eigen::Vector3d::UnitX(), normal));
    EXPECT_NEAR(normal.chi2, prior.chi2(state.cam_from_world), 1e-9 * normal.chi2);
    const auto half_chi2 = [&](const Eigen::VectorXd& step) -> Eigen::VectorXd {
      return Eigen::VectorXd::Constant(
          1, problem.chi2(moved(state, Eigen::Vector3d::UnitX(), step)) / 2);
    };
    EXPECT_TRUE(test::jacobian_agrees(normal.gradient.transpose(),
                                      test::numerical_jacobian(half_chi2, Eigen::VectorXd::Zero(8)),
                                      1e-5));
  }
}

}  // namespace
}  // namespace occ
