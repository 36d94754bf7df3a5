// SPDX-License-Identifier: Apache-2.0
// Systematic errors of an observation, and updates by data equations with them.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "libocc/track/internal/root_update.hpp"
#include "libocc/track/internal/systematic_errors.hpp"
#include "libocc/track/internal/systematic_root.hpp"
#include "tests/support/support.hpp"

namespace occ::internal::track {
namespace {

using Columns6 = Eigen::Matrix<double, 6, Eigen::Dynamic>;

Eigen::MatrixXd random_matrix(Random& random, int rows, int columns) {
  Eigen::MatrixXd m(rows, columns);
  for (Eigen::Index i = 0; i < m.size(); ++i) m.data()[i] = random.normal();
  return m;
}

void expect_near(const Eigen::MatrixXd& found, const Eigen::MatrixXd& expected,
                 double relative = 1e-9) {
  EXPECT_LT((found - expected).norm(), relative * expected.norm()) << found << "\n\n" << expected;
}

TEST(SceneErrors, AreSeparatedFromTheNoise) {
  Random random(41, 0);
  for (int trial = 0; trial < 10; ++trial) {
    // Effects of the errors on the pose, and the covariance of the pose by noise alone.
    const Columns6 effects = random_matrix(random, 6, 4);
    const Eigen::MatrixXd root = random_matrix(random, 6, 8);
    const Matrix6 noise = root * root.transpose();
    const Matrix6 all = noise + effects * effects.transpose();
    PoseObservation seen;
    seen.information = all.inverse();
    seen.gradient = random_matrix(random, 6, 1);
    const Vector6 step = all * seen.gradient;
    refine::ErrorGradient errors;
    errors.gradient_by_errors = seen.information * effects;
    using Source = refine::ErrorGradient::Source;
    errors.sources = {
        {Source::camera, 1}, {Source::map, 0}, {Source::lamp, 2, 0}, {Source::lamp, 2, 1}};
    Scene scene = test::irregular_room();
    SystematicErrors systematic{TrackerOptions{}};
    systematic.add_scene(errors, scene, 0, seen);
    expect_near(seen.information, noise.inverse());
    expect_near(noise * seen.gradient, step);
    expect_near(noise * seen.gradient_by_systematic, effects);
    EXPECT_EQ(seen.systematic, (std::vector<int>{0, 1, 2, 3}));
    // Another camera has errors of its own, but the same map and lamps.
    PoseObservation other;
    other.information = all.inverse();
    systematic.add_scene(errors, scene, 7, other);
    EXPECT_EQ(other.systematic, (std::vector<int>{4, 1, 2, 3}));
  }
}

TEST(SceneErrors, LeaveDirectionsThatTheLampsDoNotDetermine) {
  Random random(42, 0);
  // Two lamps determine four directions.
  const Eigen::MatrixXd rows = random_matrix(random, 4, 6);
  const Eigen::MatrixXd by_errors = random_matrix(random, 4, 3);
  const Eigen::MatrixXd noise = Eigen::MatrixXd::Identity(4, 4) + by_errors * by_errors.transpose();
  const Eigen::VectorXd residuals = random_matrix(random, 4, 1);
  PoseObservation seen;
  seen.information = rows.transpose() * noise.inverse() * rows;
  seen.gradient = rows.transpose() * noise.inverse() * residuals;
  refine::ErrorGradient errors;
  errors.gradient_by_errors = rows.transpose() * noise.inverse() * by_errors;
  using Source = refine::ErrorGradient::Source;
  errors.sources = {{Source::camera, 0}, {Source::camera, 1}, {Source::camera, 2}};
  SystematicErrors systematic{TrackerOptions{}};
  systematic.add_scene(errors, test::irregular_room(), 0, seen);
  expect_near(seen.information, rows.transpose() * rows, 1e-7);
  expect_near(seen.gradient, rows.transpose() * residuals, 1e-7);
  expect_near(seen.gradient_by_systematic, rows.transpose() * by_errors, 1e-7);
}

TEST(SceneErrors, NoneChangeNothing) {
  PoseObservation seen;
  seen.information = 3 * Matrix6::Identity();
  SystematicErrors systematic{TrackerOptions{}};
  systematic.add_scene({}, test::irregular_room(), 0, seen);
  EXPECT_EQ(seen.information, Matrix6(3 * Matrix6::Identity()));
  EXPECT_TRUE(seen.systematic.empty());
}

TrackerOptions with_own_errors() {
  TrackerOptions options;
  options.mount_sigma_rad = 0.02;
  options.mount_sigma_m = 0.005;
  options.clock_sigma_s = 0.003;
  return options;
}

TEST(OwnErrors, MoveTheCameraByMountAndClock) {
  Random random(43, 0);
  const TrackerOptions options = with_own_errors();
  const Vector6 velocity = random_matrix(random, 6, 1);
  SystematicErrors systematic(options);
  EXPECT_TRUE(systematic.has_own());
  Matrix6 expected = Matrix6::Zero();
  expected.diagonal() << 4e-4, 4e-4, 4e-4, 2.5e-5, 2.5e-5, 2.5e-5;
  expected += 9e-6 * velocity * velocity.transpose();
  expect_near(systematic.own_covariance(velocity), expected);
  const Eigen::MatrixXd root = random_matrix(random, 6, 9);
  PoseObservation seen;
  seen.information = root * root.transpose();
  systematic.add_own(2, velocity, seen);
  const Columns6 effects = seen.information.inverse() * seen.gradient_by_systematic;
  ASSERT_EQ(effects.cols(), 7);
  expect_near(effects * effects.transpose(), expected, 1e-7);
  EXPECT_EQ(seen.uncertain_systematic, 1);
  // Cameras have mounts of their own and share the clock.
  PoseObservation other = seen;
  other.systematic.clear();
  other.gradient_by_systematic.resize(6, 0);
  systematic.add_own(3, velocity, other);
  EXPECT_EQ(seen.systematic, (std::vector<int>{0, 1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(other.systematic, (std::vector<int>{7, 8, 9, 10, 11, 12, 6}));
}

TEST(OwnErrors, AreThoseOfTheOptionsOnly) {
  TrackerOptions options;
  options.mount_sigma_rad = options.mount_sigma_m = options.clock_sigma_s = 0;
  EXPECT_FALSE(SystematicErrors(options).has_own());
  PoseObservation seen;
  seen.information.setIdentity();
  SystematicErrors(options).add_own(0, Vector6::Ones(), seen);
  EXPECT_TRUE(seen.systematic.empty());
  EXPECT_EQ(seen.uncertain_systematic, 0);
  options.clock_sigma_s = 0.001;
  EXPECT_TRUE(SystematicErrors(options).has_own());
  options.clock_sigma_s = 0;
  options.mount_sigma_m = 0.001;
  EXPECT_TRUE(SystematicErrors(options).has_own());
  SystematicErrors(options).add_own(0, Vector6::Ones(), seen);
  EXPECT_EQ(seen.systematic.size(), 3u);
  EXPECT_EQ(seen.uncertain_systematic, 0);
}

TEST(OwnErrors, AreCorrelatedWithAPredictionThatDependsOnThem) {
  Random random(44, 0);
  const TrackerOptions options = with_own_errors();
  SystematicErrors systematic(options);
  const Rigid3 cam_from_body = test::random_pose(random);
  const Matrix6 moves = adjoint(cam_from_body);
  PosePrediction predicted;
  const Eigen::MatrixXd root = 0.02 * random_matrix(random, 6, 9);
  predicted.velocity = random_matrix(random, 6, 1);
  predicted.by_systematic = 0.01 * random_matrix(random, 6, 3);
  predicted.systematic = {40, 6, 1};  // an unknown one, the clock, and the mount about y
  predicted.covariance =
      root * root.transpose() + predicted.by_systematic * predicted.by_systematic.transpose();
  // Without an observation no error is known, and the parts are independent.
  const Vector6 late = moves * predicted.velocity * 0.003;
  Columns6 own = Columns6::Zero(6, 7);
  own.diagonal() << 0.02, 0.02, 0.02, 0.005, 0.005, 0.005;
  own.col(6) = late;
  const Matrix6 of_body = moves * predicted.covariance * moves.transpose();
  expect_near(systematic.camera_covariance(predicted, cam_from_body, 0),
              of_body + own * own.transpose());
  PoseObservation seen;
  seen.information.setIdentity();
  systematic.add_own(0, predicted.velocity, seen);
  // The camera moves by the body's error and by the same errors of mount and clock.
  Columns6 together = own;
  together.col(6) += moves * predicted.by_systematic.col(1);
  together.col(1) += moves * predicted.by_systematic.col(2);
  const Vector6 alone = moves * predicted.by_systematic.col(0);
  const Matrix6 noise = moves * root * root.transpose() * moves.transpose();
  expect_near(systematic.camera_covariance(predicted, cam_from_body, 0),
              noise + together * together.transpose() + alone * alone.transpose());
  // The mount of another camera is independent of the prediction.
  Columns6 other = own;
  other.col(6) = together.col(6);
  const Vector6 of_mount = moves * predicted.by_systematic.col(2);
  expect_near(systematic.camera_covariance(predicted, cam_from_body, 1),
              noise + other * other.transpose() + alone * alone.transpose() +
                  of_mount * of_mount.transpose());
}

TEST(OwnErrors, NoneLeaveTheCovarianceOfTheBody) {
  Random random(45, 0);
  TrackerOptions options;
  options.mount_sigma_rad = options.mount_sigma_m = options.clock_sigma_s = 0;
  PosePrediction predicted;
  const Eigen::MatrixXd root = random_matrix(random, 6, 9);
  predicted.covariance = root * root.transpose();
  const Rigid3 cam_from_body = test::random_pose(random);
  const Matrix6 moves = adjoint(cam_from_body);
  expect_near(SystematicErrors(options).camera_covariance(predicted, cam_from_body, 0),
              moves * predicted.covariance * moves.transpose());
}

TEST(DataEquation, HasTheInformationOfTheNormalEquations) {
  Random random(46, 0);
  for (int rank = 1; rank <= 6; ++rank) {
    const Eigen::MatrixXd rows =
        random_matrix(random, rank, 6) * Vector6(1e3, 2, 5, 1e-3, 1, 40).asDiagonal();
    const Eigen::VectorXd residuals = random_matrix(random, rank, 1);
    const Eigen::MatrixXd by_errors = random_matrix(random, rank, 2);
    const DataEquation<6> found = data_equation(
        rows.transpose() * rows, rows.transpose() * residuals, rows.transpose() * by_errors);
    EXPECT_EQ(found.rows.rows(), rank);
    expect_near(found.rows.transpose() * found.rows, rows.transpose() * rows, 1e-7);
    expect_near(found.rows.transpose() * found.residuals, rows.transpose() * residuals, 1e-6);
    expect_near(found.rows.transpose() * found.systematic, rows.transpose() * by_errors, 1e-6);
    EXPECT_EQ(data_equation(rows.transpose() * rows, Vector6::Zero()).systematic.cols(), 0);
  }
  EXPECT_EQ(data_equation(Matrix6::Zero(), Vector6::Zero()).rows.rows(), 0);
}

TEST(DataEquation, EliminatesThreeUnknownsOfUnitVariance) {
  Random random(47, 0);
  for (const int count : {1, 2, 3, 4, 6})
    for (const int errors : {0, 2}) {
      const Eigen::MatrixXd across = random_matrix(random, count, 3);
      const Eigen::MatrixXd along = random_matrix(random, count, 3);
      DataEquation<6> seen;
      seen.rows.setZero(count, 6);
      seen.residuals = random_matrix(random, count, 1);
      if (errors > 0) seen.systematic = random_matrix(random, count, errors);
      const DataEquation<3> found = eliminated(across, along, seen);
      const Eigen::MatrixXd weight =
          (Eigen::MatrixXd::Identity(count, count) + across * across.transpose()).inverse();
      expect_near(found.rows.transpose() * found.rows, along.transpose() * weight * along);
      expect_near(found.rows.transpose() * found.residuals,
                  along.transpose() * weight * seen.residuals);
      EXPECT_EQ(found.systematic.cols(), errors);
      if (errors > 0) {
        expect_near(found.rows.transpose() * found.systematic,
                    along.transpose() * weight * seen.systematic);
      }
      EXPECT_EQ(found.rows.rows(), std::min(count, 3));
    }
}

TEST(DataEquation, LeavesNoRowOfRounding) {
  Random random(48, 0);
  // Six rows that determine a single direction of the three.
  const Eigen::MatrixXd across = Eigen::MatrixXd::Zero(6, 3);
  const Eigen::MatrixXd along = random_matrix(random, 6, 1) * random_matrix(random, 1, 3);
  DataEquation<6> seen;
  seen.residuals = random_matrix(random, 6, 1);
  seen.systematic = random_matrix(random, 6, 2);
  const DataEquation<3> found = eliminated(across, along, seen);
  EXPECT_GT(found.rows.row(0).norm(), 0.1);
  for (int i = 1; i < 3; ++i) {
    EXPECT_TRUE(found.rows.row(i).isZero(0)) << i;
    EXPECT_TRUE(found.systematic.row(i).isZero(0)) << i;
  }
}

/// State of nine unknowns that depends on four errors, of which a measurement of six has the last
/// two, with Kalman's equations for the joint state.
struct JointState {
  Eigen::MatrixXd root, errors;  // R, and C with a row for each error
  DataEquation<6> seen;
  Eigen::MatrixXd covariance;  // of states and errors

  explicit JointState(std::uint64_t seed) {
    Random random(49, seed);
    root = random_matrix(random, 9, 9).triangularView<Eigen::Upper>();
    errors = random_matrix(random, 4, 9);
    seen.rows = random_matrix(random, 5, 6);
    seen.residuals = random_matrix(random, 5, 1);
    seen.systematic = random_matrix(random, 5, 2);
    covariance = Eigen::MatrixXd::Identity(13, 13);
    covariance.topLeftCorner(9, 9) = root.transpose() * root + errors.transpose() * errors;
    covariance.topRightCorner(9, 4) = errors.transpose();
    covariance.bottomLeftCorner(4, 9) = errors;
  }
  Eigen::MatrixXd measured() const {
    Eigen::MatrixXd h = Eigen::MatrixXd::Zero(5, 13);
    h.leftCols(6) = seen.rows;
    h.rightCols(2) = seen.systematic;
    return h;
  }
  Eigen::MatrixXd innovation() const {
    const Eigen::MatrixXd h = measured();
    return h * covariance * h.transpose() + Eigen::MatrixXd::Identity(5, 5);
  }
};

/// Schmidt's filter: the errors keep their variances, so the gain of their rows is zero.
TEST(SystematicUpdate, IsTheOneOfSchmidt) {
  for (std::uint64_t seed = 0; seed < 5; ++seed) {
    const JointState state(seed);
    const SystematicUpdate update(state.root, state.errors, state.seen, 0);
    const Eigen::MatrixXd h = state.measured(), s = state.innovation();
    Eigen::MatrixXd gain = state.covariance * h.transpose() * s.inverse();
    gain.bottomRows(4).setZero();
    const Eigen::MatrixXd left = Eigen::MatrixXd::Identity(13, 13) - gain * h;
    const Eigen::MatrixXd joint =
        left * state.covariance * left.transpose() + gain * gain.transpose();
    expect_near(update.step(), -gain.topRows(9) * state.seen.residuals);
    expect_near(update.errors(), joint.bottomLeftCorner(4, 9), 1e-8);
    expect_near(
        update.root().transpose() * update.root() + update.errors().transpose() * update.errors(),
        joint.topLeftCorner(9, 9), 1e-8);
    EXPECT_NEAR(update.nis(), state.seen.residuals.dot(s.inverse() * state.seen.residuals), 1e-8);
    EXPECT_EQ(update.dof(), 5);
  }
}

TEST(SystematicUpdate, RowsThatThePredictionKnowsDoNotCount) {
  JointState state(1);
  state.seen.rows *= 1e-5;
  state.seen.systematic *= 1e-5;
  const SystematicUpdate update(state.root, state.errors, state.seen, 0);
  EXPECT_EQ(update.dof(), 0);
  EXPECT_EQ(update.nis(), 0);
}

TEST(SystematicUpdate, AnErrorWithUncertainDerivativesHasLessWeight) {
  const JointState state(2);
  const SystematicUpdate exact(state.root, state.errors, state.seen, 0);
  const SystematicUpdate uncertain(state.root, state.errors, state.seen, 1);
  // The gain is smaller, the NIS and its variance are the same.
  EXPECT_LT(uncertain.step().norm(), exact.step().norm());
  EXPECT_GT(uncertain.step().norm(), 0.02 * exact.step().norm());
  EXPECT_NEAR(uncertain.nis(), exact.nis(), 1e-9);
  const auto variance = [](const SystematicUpdate& update) {
    return update.root().squaredNorm() + update.errors().squaredNorm();
  };
  EXPECT_GT(variance(uncertain), variance(exact));
}

}  // namespace
}  // namespace occ::internal::track
