// SPDX-License-Identifier: Apache-2.0
// Covariances of PoseFilter and PlanarFilter stay positive definite: after gaps, with singular
// observations, and in random streams of measurements.
#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <string>

#include "libocc/track/planar_filter.hpp"
#include "libocc/track/pose_filter.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

const Rigid3 start_pose = look_at({1, 2, 0.5}, {2, 2, 1}, {0, 0, 1});

Eigen::MatrixXd random_matrix(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

/// Random covariance with standard deviations from 1e-2 to 10 times `sigma`.
Eigen::MatrixXd random_covariance(Random& random, Eigen::Index size, double sigma) {
  Eigen::MatrixXd root = sigma * random_matrix(random, size, size);
  for (Eigen::Index i = 0; i < size; ++i) root.row(i) *= std::pow(10, random.uniform(-2, 1));
  return root * root.transpose() + 1e-10 * Eigen::MatrixXd::Identity(size, size);
}

/// Checks that a covariance is finite and symmetric, and that its correlations are positive
/// definite.
::testing::AssertionResult is_covariance(const Eigen::MatrixXd& covariance) {
  const auto failure = [&](const std::string& fault) {
    return ::testing::AssertionFailure() << fault << "\n" << covariance;
  };
  if (!covariance.allFinite()) return failure("not finite");
  if (covariance != covariance.transpose()) return failure("asymmetric");
  if (!(covariance.diagonal().minCoeff() > 0)) return failure("a variance is not positive");
  const Eigen::VectorXd unit = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = unit.asDiagonal() * covariance * unit.asDiagonal();
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation).eigenvalues()[0];
  if (!(least > 0)) return failure("eigenvalue of the correlation " + std::to_string(least));
  return ::testing::AssertionSuccess();
}

::testing::AssertionResult is_valid(const PoseEstimate& estimate) {
  const Rigid3& pose = estimate.body_from_world;
  if (!pose.rotation.allFinite() || !pose.translation.allFinite() || !estimate.velocity.allFinite())
    return ::testing::AssertionFailure() << "a state is not finite\n" << pose.matrix();
  const auto velocity = is_covariance(estimate.velocity_covariance);
  return velocity ? is_covariance(estimate.covariance) : velocity;
}

PoseFilterOptions without_gate() {
  PoseFilterOptions options;
  options.gate_sigma = std::numeric_limits<double>::infinity();
  return options;
}

/// Runs a filter through ten images and a gap.
PoseFilter after_gap(double gap_s, const Matrix6& covariance) {
  PoseFilter filter(without_gate());
  filter.start(0, start_pose, covariance);
  for (int i = 1; i < 10; ++i)
    filter.add(PoseObservation::of_pose(i / 30.0, start_pose, covariance));
  EXPECT_TRUE(is_valid(*filter.at(0.3 + gap_s))) << "gap of " << gap_s << " s";
  return filter;
}

TEST(FilterCovariance, AnImageAfterAGapDeterminesThePose) {
  for (const double gap_s : {1.0, 60.0, 1000.0, 36000.0}) {
    for (const double sigma : {1e-3, 1e-6}) {
      const Matrix6 covariance = sigma * sigma * Matrix6::Identity();
      PoseFilter filter = after_gap(gap_s, covariance);
      const double time_s = 0.3 + gap_s;
      filter.add(PoseObservation::of_pose(time_s, start_pose, covariance));
      const PoseEstimate first = *filter.at(time_s);
      EXPECT_TRUE(is_valid(first)) << "gap of " << gap_s << " s, sigma " << sigma;
      // The prediction adds less than (1e-3 / 0.6)^2 to the information of the image.
      EXPECT_LT((first.covariance - covariance).norm(), 1e-5 * covariance.norm());
      EXPECT_LT(difference(first.body_from_world, start_pose).norm(), 1e-3 * sigma);
      for (int i = 1; i < 20; ++i) {
        filter.add(PoseObservation::of_pose(time_s + i / 30.0, start_pose, covariance));
        EXPECT_TRUE(is_valid(*filter.at(time_s + i / 30.0))) << "gap of " << gap_s << " s";
      }
      EXPECT_LT(difference(filter.at(time_s + 0.6)->body_from_world, start_pose).norm(), sigma);
    }
  }
}

TEST(FilterCovariance, ASingularImageAfterAGapLeavesTheOtherDirections) {
  const double sigma = 1e-6;
  for (int subset = 1; subset < 63; ++subset) {
    PoseFilter filter = after_gap(1000, sigma * sigma * Matrix6::Identity());
    const Matrix6 before = filter.at(1000.3)->covariance;
    PoseObservation seen;
    seen.time_s = 1000.3;
    seen.cam_from_world = filter.at(1000.3)->body_from_world;
    int rank = 0;
    for (int i = 0; i < 6; ++i) {
      if (!(subset >> i & 1)) continue;
      seen.information(i, i) = 1 / (sigma * sigma);
      ++rank;
    }
    EXPECT_EQ(filter.add(seen).nis_dof, rank);
    const PoseEstimate after = *filter.at(1000.3);
    EXPECT_TRUE(is_valid(after)) << "subset " << subset;
    EXPECT_LT(difference(after.body_from_world, seen.cam_from_world).norm(), 1e-3 * sigma);
    for (int i = 0; i < 6; ++i) {
      const bool measured = subset >> i & 1;
      const double expected = measured ? sigma * sigma : before(i, i);
      EXPECT_NEAR(after.covariance(i, i), expected, 1e-3 * expected) << "subset " << subset;
    }
  }
}

TEST(FilterCovariance, AVehiclesImageAfterAGapDeterminesThePose) {
  for (const double gap_s : {1.0, 60.0, 1000.0, 36000.0}) {
    PlanarFilterOptions options;
    options.gate_sigma = std::numeric_limits<double>::infinity();
    PlanarFilter filter(options);
    const PlanarPose pose{1, 2, 0.5};
    const double sigma = 1e-6;
    filter.start(0, pose, sigma * sigma * Eigen::Matrix3d::Identity());
    filter.add(PoseObservation::of_pose(gap_s, body_from_world(pose),
                                        sigma * sigma * Matrix6::Identity()));
    for (const double later_s : {0.0, 1.0, 1e4, 1e9}) {
      const PlanarEstimate estimate = *filter.at(gap_s + later_s);
      EXPECT_TRUE(is_covariance(estimate.covariance)) << "gap of " << gap_s << " s";
      EXPECT_TRUE(is_covariance(estimate.velocity_covariance)) << "gap of " << gap_s << " s";
      EXPECT_TRUE(is_covariance(filter.predict(gap_s + later_s)->covariance));
    }
    const PlanarEstimate estimate = *filter.at(gap_s);
    EXPECT_LT(difference(estimate.pose, pose).norm(), 0.1 * sigma);
    EXPECT_LT((estimate.covariance / (sigma * sigma) - Eigen::Matrix3d::Identity()).norm(), 1e-3);
  }
}

TEST(FilterCovariance, OdometryWithoutNoiseIsAccepted) {
  PoseFilter filter;
  filter.start(0, start_pose, 1e-8 * Matrix6::Identity());
  EXPECT_TRUE(filter.add(Odometry{0, 1, {}, Matrix6::Zero()}).accepted());
  Matrix6 singular = Matrix6::Zero();
  singular.bottomRightCorner<3, 3>().setConstant(1e-4);
  EXPECT_TRUE(filter.add(Odometry{1, 2, {}, singular}).accepted());
  EXPECT_TRUE(is_covariance(filter.at(2)->covariance));
  EXPECT_NEAR(filter.at(2)->covariance(3, 4), 1e-4, 1e-9);
}

TEST(FilterInput, CovariancesMustBeSymmetricAndSemidefinite) {
  Matrix6 indefinite = 1e-4 * Matrix6::Identity(), asymmetric = indefinite;
  indefinite(0, 1) = indefinite(1, 0) = 1;
  asymmetric(0, 1) = 5e-5;
  PoseFilter filter;
  const auto starting = [&](const Matrix6& c) {
    return test::complaint([&] { filter.start(0, start_pose, c); });
  };
  EXPECT_NE(starting(asymmetric).find("covariance must be symmetric, got"), std::string::npos);
  EXPECT_NE(starting(indefinite).find("covariance must be positive definite"), std::string::npos);
  filter.start(0, start_pose, 1e-4 * Matrix6::Identity());
  const auto driving = [&](const Matrix6& c) {
    return test::complaint([&] { filter.add(Odometry{0, 1, {}, c}); });
  };
  EXPECT_NE(driving(asymmetric).find("covariance must be symmetric"), std::string::npos);
  EXPECT_NE(driving(indefinite).find("covariance must be positive semi"), std::string::npos);
  const auto seeing = [&](const Matrix6& information) {
    PoseObservation seen;
    seen.information = information;
    return test::complaint([&] { filter.add(seen); });
  };
  EXPECT_NE(seeing(asymmetric).find("information must be symmetric"), std::string::npos);
  EXPECT_NE(seeing(indefinite).find("information must be positive semi"), std::string::npos);
  EXPECT_NE(seeing(-Matrix6::Identity()).find("information must be positive semi"),
            std::string::npos);
  EXPECT_THROW(PoseObservation::of_pose(0, start_pose, asymmetric), std::invalid_argument);
}

TEST(FilterInput, CovariancesOnAFloorMustBeSymmetricAndSemidefinite) {
  Eigen::Matrix3d indefinite = 1e-4 * Eigen::Matrix3d::Identity(), asymmetric = indefinite;
  indefinite(0, 1) = indefinite(1, 0) = 1;
  asymmetric(0, 1) = 5e-5;
  for (const Eigen::Matrix3d& wrong : {indefinite, asymmetric}) {
    PlanarFilter filter;
    EXPECT_THROW(filter.start(0, {}, wrong), std::invalid_argument);
    filter.start(0, {}, 1e-4 * Eigen::Matrix3d::Identity());
    EXPECT_THROW(filter.add(PlanarOdometry{0, 1, {}, wrong}), std::invalid_argument);
  }
}

std::size_t random_index(Random& random, std::size_t count) {
  return static_cast<std::size_t>(random.uniform() * static_cast<double>(count));
}

double pick(Random& random, std::initializer_list<double> values) {
  return values.begin()[random_index(random, values.size())];
}

PoseObservation random_image(Random& random, double time_s) {
  Vector6 off;
  off << 0.05 * test::random_vector(random), 0.1 * test::random_vector(random);
  const Rigid3 pose = perturb(start_pose, off);
  if (random.uniform() < 0.5)
    return PoseObservation::of_pose(time_s, pose, random_covariance(random, 6, 0.1));
  PoseObservation seen;
  seen.time_s = time_s;
  seen.cam_from_world = pose;
  const auto rank = static_cast<Eigen::Index>(1 + random_index(random, 5));
  const Eigen::MatrixXd rows = std::pow(10, random.uniform(-1, 4)) * random_matrix(random, rank, 6);
  seen.information = rows.transpose() * rows;
  seen.gradient = rows.transpose() * random_matrix(random, rank, 1);
  return seen;
}

/// Adds 40 random measurements with random gaps; a third of them arrive late.
void add_random_stream(Random& random, PoseFilter& filter) {
  double time_s = 0;
  for (int i = 0; i < 40; ++i) {
    time_s += pick(random, {0, 1e-9, 0.01, 0.1, 1, 30, 3000}) * random.uniform(0.5, 1.5);
    const double late_s = pick(random, {0, 0, 0.05});
    const std::size_t kind = random_index(random, 4);
    if (kind == 0) {
      ImuSample sample;
      sample.time_s = time_s - late_s;
      sample.turn_rate_rad_s = test::random_vector(random);
      sample.acceleration_m_s2 = 3 * test::random_vector(random) + Eigen::Vector3d(0, 0, 9.8);
      filter.add(sample);
    } else if (kind == 1) {
      const double begin_s = time_s;
      time_s += std::pow(10, random.uniform(-6, 1));
      Vector6 off;
      off << 0.1 * test::random_vector(random), 0.1 * test::random_vector(random);
      filter.add(Odometry{begin_s, time_s, perturb({}, off), random_covariance(random, 6, 0.01)});
    } else {
      filter.add(random_image(random, time_s - late_s));
    }
  }
  for (const double later_s : {0.0, 1.0, 1e4, 1e9}) {
    EXPECT_TRUE(is_valid(*filter.at(time_s + later_s))) << later_s << " s later";
  }
}

void add_random_stream(Random& random, PlanarFilter& filter) {
  double time_s = 0;
  for (int i = 0; i < 40; ++i) {
    time_s += pick(random, {1e-9, 0.01, 0.1, 5, 3000});
    const std::size_t kind = random_index(random, 3);
    if (kind == 0) {
      ImuSample sample;
      sample.time_s = time_s;
      sample.turn_rate_rad_s = test::random_vector(random);
      filter.add(sample);
    } else if (kind == 1) {
      const PlanarPose by{random.normal(), random.normal(), random.normal()};
      filter.add(PlanarOdometry{time_s, time_s + 0.1, by, random_covariance(random, 3, 0.01)});
      time_s += 0.1;
    } else {
      filter.add(random_image(random, time_s));
    }
  }
  for (const double later_s : {0.0, 1.0, 1e4, 1e9}) {
    const PlanarEstimate estimate = *filter.at(time_s + later_s);
    EXPECT_TRUE(estimate.pose.finite() && estimate.velocity.allFinite());
    EXPECT_TRUE(is_covariance(estimate.covariance)) << later_s << " s later";
    EXPECT_TRUE(is_covariance(estimate.velocity_covariance)) << later_s << " s later";
  }
}

void random_streams_keep_covariances(std::uint64_t streams) {
  for (std::uint64_t seed = 0; seed < streams && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("stream " + std::to_string(seed));
    Random random(seed);
    PoseFilterOptions options;
    options.history_s = pick(random, {0.5, 2, 100});
    options.gate_sigma = pick(random, {3, 5, std::numeric_limits<double>::infinity()});
    PoseFilter in_space(options);
    in_space.start(0, start_pose, random_covariance(random, 6, 0.1));
    add_random_stream(random, in_space);
    PlanarFilter on_floor;
    on_floor.start(0, {1, 2, 3.1}, random_covariance(random, 3, 0.1));
    add_random_stream(random, on_floor);
  }
}

TEST(FilterCovariance, RandomStreams) { random_streams_keep_covariances(30); }
TEST(SlowFilterCovariance, RandomStreams) { random_streams_keep_covariances(5000); }

}  // namespace
}  // namespace occ
