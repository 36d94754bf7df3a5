// SPDX-License-Identifier: Apache-2.0
// Tests of rotations and rigid transforms.
#include <Eigen/Eigenvalues>
#include <limits>

#include "libocc/core/math.hpp"
#include "tests/support/support.hpp"

namespace occ {
namespace {

const std::vector<double> angles{0,    1e-300, 1e-12,  1e-8, 1e-4,      0.1, 0.5,
                                 0.99, 1.01,   pi / 2, 3,    pi - 1e-9, pi};

/// Sum over k of skew(w)^k / (k + shift)!: exponential (shift 0) and left Jacobian (shift 1).
Eigen::Matrix3d power_series(const Eigen::Vector3d& w, int shift) {
  Eigen::Matrix3d term = Eigen::Matrix3d::Identity(), sum = term;
  for (int k = 1; k < 60; ++k) {
    term = term * skew(w) / (k + shift);
    sum += term;
  }
  return sum;
}

TEST(So3, SkewIsTheCrossProduct) {
  Random random(1);
  const Eigen::Vector3d a = test::random_vector(random), b = test::random_vector(random);
  EXPECT_LT((skew(a) * b - a.cross(b)).norm(), 1e-15);
}

TEST(So3, ExponentialAndLeftJacobianEqualTheirPowerSeries) {
  Random random(2);
  for (const double angle : angles) {
    const Eigen::Vector3d w = angle * test::random_vector(random).normalized();
    EXPECT_LT((so3_exp(w) - power_series(w, 0)).norm(), 1e-13) << angle;
    EXPECT_LT((so3_left_jacobian(w) - power_series(w, 1)).norm(), 1e-13) << angle;
    const Eigen::Matrix3d r = so3_exp(w);
    EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
  }
}

TEST(So3, LogarithmIsTheInverseOfTheExponential) {
  Random random(3);
  for (const double angle : angles) {
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector3d w = angle * test::random_vector(random).normalized();
      const Eigen::Vector3d back = so3_log(so3_exp(w));
      // At pi both w and -w are correct.
      const double error =
          std::min((back - w).norm(), angle >= pi - 1e-12 ? (back + w).norm() : 1e300);
      EXPECT_LE(error, angle < 1e-7 ? 1e-14 * angle : 1e-14) << angle;
    }
  }
}

TEST(So3, LogarithmAtHalfTurnsAboutTheAxes) {
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Matrix3d half_turn = -Eigen::Matrix3d::Identity();
    half_turn(axis, axis) = 1;
    EXPECT_NEAR(std::abs(so3_log(half_turn)[axis]), pi, 1e-15);
    EXPECT_NEAR(so3_log(half_turn).norm(), pi, 1e-15);
  }
}

TEST(So3, LeftJacobianAgreesWithCentralDifferences) {
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d w = test::random_vector(random);
    const Eigen::MatrixXd numeric = test::numerical_jacobian(
        [&](const Eigen::VectorXd& v) -> Eigen::VectorXd {
          return so3_log(so3_exp(v) * so3_exp(w).transpose());
        },
        w);
    EXPECT_TRUE(test::jacobian_agrees(so3_left_jacobian(w), numeric));
    EXPECT_FALSE(test::jacobian_agrees(so3_left_jacobian(-w), numeric));  // the right Jacobian
  }
}

TEST(So3, ShortestRotationTurnsAsLittleAsPossible) {
  Random random(21);
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d from = 3 * test::random_vector(random).normalized();
    Eigen::Vector3d to = test::random_vector(random).normalized();
    if (i % 4 == 1) to = -from;
    if (i % 4 == 2) to = from;
    if (i % 4 == 3) to = -from + 1e-5 * test::random_vector(random);  // almost opposite
    const Eigen::Matrix3d turn = shortest_rotation(from, to);
    const double angle = std::atan2(from.cross(to).norm(), from.dot(to));
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-9) << i;
    EXPECT_LT((turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-9) << i;
    EXPECT_NEAR(so3_log(turn).norm(), angle, 1e-6) << i;
  }
}

TEST(So3, NearestRotationIsNearer) {
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    Eigen::Matrix3d m;
    for (int j = 0; j < 3; ++j) m.col(j) = test::random_vector(random);
    const Eigen::Matrix3d r = nearest_rotation(m);
    EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_NEAR(r.determinant(), 1, 1e-14);
    for (int k = 0; k < 50; ++k) {
      const Eigen::Matrix3d other = so3_exp(0.3 * test::random_vector(random)) * r;
      EXPECT_GE((other - m).norm(), (r - m).norm() - 1e-13);
    }
  }
  const Eigen::Matrix3d r = so3_exp({0.3, -2, 1});
  EXPECT_LT((nearest_rotation(5 * r) - r).norm(), 1e-14);
}

TEST(Rigid3, ChainsAndInverts) {
  Random random(6);
  const Rigid3 b_from_a = test::random_pose(random), c_from_b = test::random_pose(random);
  const Eigen::Vector3d p = test::random_vector(random);
  EXPECT_LT((c_from_b * (b_from_a * p) - (c_from_b * b_from_a) * p).norm(), 1e-14);
  EXPECT_LT((b_from_a.inverse() * (b_from_a * p) - p).norm(), 1e-14);
  EXPECT_LT((b_from_a * b_from_a.origin_in_source()).norm(), 1e-14);
  EXPECT_LT((c_from_b.matrix() * b_from_a.matrix() - (c_from_b * b_from_a).matrix()).norm(), 1e-14);
}

TEST(Rigid3, FromMatrixAcceptsRigidMatricesOnly) {
  Random random(7);
  const Eigen::Matrix4d good = test::random_pose(random).matrix();
  EXPECT_EQ(Rigid3::from_matrix(good).matrix(), good);
  const auto refuses = [&](auto change) {
    Eigen::Matrix4d bad = good;
    change(bad);
    try {
      Rigid3::from_matrix(bad, "pose");
      ADD_FAILURE() << "accepted\n" << bad;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(std::string(error.what()).find("pose"), 0u) << error.what();
    }
  };
  refuses([](Eigen::Matrix4d& m) { m(0, 3) = std::numeric_limits<double>::quiet_NaN(); });
  refuses([](Eigen::Matrix4d& m) { m(1, 1) = std::numeric_limits<double>::infinity(); });
  refuses([](Eigen::Matrix4d& m) { m(3, 0) = 1e-3; });
  refuses([](Eigen::Matrix4d& m) { m(3, 3) = 2; });
  refuses([](Eigen::Matrix4d& m) { m.topLeftCorner<3, 3>() *= 1.0001; });
  refuses([](Eigen::Matrix4d& m) { m.row(0).head<3>() *= -1; });
  refuses([](Eigen::Matrix4d& m) { m.setZero(); });
}

TEST(Rigid3, PerturbMovesPointsAsDefinedAndDifferenceInvertsIt) {
  Random random(8);
  const Rigid3 pose = test::random_pose(random);
  const Eigen::Vector3d p = test::random_vector(random);
  Eigen::Matrix<double, 3, 6> analytic;
  analytic << -skew(pose * p), Eigen::Matrix3d::Identity();
  const Eigen::MatrixXd numeric = test::numerical_jacobian(
      [&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return perturb(pose, d) * p; },
      Vector6::Zero());
  EXPECT_TRUE(test::jacobian_agrees(analytic, numeric));
  for (int i = 0; i < 20; ++i) {
    Vector6 delta;
    delta << test::random_vector(random).normalized() * 3, 5 * test::random_vector(random);
    EXPECT_LT((difference(perturb(pose, delta), pose) - delta).norm(), 1e-13);
  }
}

TEST(Rigid3, PositionCovarianceAgreesWithPerturbedPositions) {
  Random random(9);
  const Rigid3 pose = test::random_pose(random);
  Matrix6 root;
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = 1e-3 * random.normal();
  const Matrix6 covariance = root * root.transpose();
  Eigen::Matrix3d sampled = Eigen::Matrix3d::Zero();
  constexpr int n = 100000;
  for (int i = 0; i < n; ++i) {
    Vector6 unit;
    unit << test::random_vector(random), test::random_vector(random);
    const Eigen::Vector3d moved =
        perturb(pose, root * unit).origin_in_source() - pose.origin_in_source();
    sampled += moved * moved.transpose() / n;
  }
  const Eigen::Matrix3d stated = position_covariance(pose, covariance);
  EXPECT_LT((stated - sampled).norm() / sampled.norm(), 0.03);
}

// Second moment of the nonlinear part of random rotations.
Eigen::Matrix3d sampled_arc_moment(const Eigen::Matrix3d& root, const Eigen::Vector3d& arm) {
  constexpr int count = 200000;
  Random random(77);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d w = root * test::random_vector(random);
    const Eigen::Vector3d off = so3_exp(w) * arm - arm - w.cross(arm);
    sum += off * off.transpose() / count;
  }
  return sum;
}

TEST(ArcMoment, AgreesWithRandomRotations) {
  const Eigen::Vector3d arm(0.4, -1.1, 2.5);
  Eigen::Matrix3d round, about_one_axis = Eigen::Matrix3d::Zero();
  round << 0.06, 0.01, 0, -0.02, 0.05, 0.01, 0, 0.03, 0.04;
  about_one_axis.col(0) = 0.12 * Eigen::Vector3d(0.6, 0, 0.8);
  for (const Eigen::Matrix3d& root : {round, about_one_axis}) {
    const Eigen::Matrix3d sampled = sampled_arc_moment(root, arm);
    const Eigen::Matrix3d moment = arc_moment(root * root.transpose(), arm);
    EXPECT_LT((moment - sampled).norm(), 0.04 * sampled.norm()) << moment << "\n\n" << sampled;
  }
}

TEST(ArcMoment, VanishesWithTheRotationAndAtThePivot) {
  const Eigen::Vector3d arm(1, 2, 3);
  EXPECT_EQ(arc_moment(Eigen::Matrix3d::Zero(), arm), Eigen::Matrix3d::Zero());
  const Eigen::Matrix3d covariance = Eigen::Vector3d(0.1, 0.2, 0.3).asDiagonal();
  EXPECT_EQ(arc_moment(covariance, Eigen::Vector3d::Zero()), Eigen::Matrix3d::Zero());
  const Eigen::Matrix3d about_arm = 0.01 * arm * arm.transpose();
  EXPECT_LT(arc_moment(about_arm, arm).norm(), 1e-12);
}

TEST(LookAt, PutsTheTargetAheadAndUpUpwards) {
  const Eigen::Vector3d position(1, 2, 3), target(4, -1, 2.5), up(0.1, 0, 1);
  const Rigid3 pose = look_at(position, target, up);
  EXPECT_LT((pose * position).norm(), 1e-14);
  const Eigen::Vector3d ahead = pose * target;
  EXPECT_LT(ahead.head<2>().norm(), 1e-14);
  EXPECT_NEAR(ahead.z(), (target - position).norm(), 1e-14);
  const Eigen::Vector3d up_in_cam = pose.rotation * up;
  EXPECT_NEAR(up_in_cam.x(), 0, 1e-14);
  EXPECT_LT(up_in_cam.y(), 0);  // y points down in the image
  EXPECT_NO_THROW(Rigid3::from_matrix(pose.matrix()));
}

TEST(LookAt, RejectsUndefinedViews) {
  const Eigen::Vector3d here(1, 2, 3), z = Eigen::Vector3d::UnitZ();
  EXPECT_THROW(look_at(here, here, z), std::invalid_argument);
  EXPECT_THROW(look_at(here, here + 2 * z, z), std::invalid_argument);
  EXPECT_THROW(look_at(here, here - 2 * z, 7 * z), std::invalid_argument);
  EXPECT_THROW(look_at(here, here + z, Eigen::Vector3d::Zero()), std::invalid_argument);
  EXPECT_THROW(look_at(here, Eigen::Vector3d::Constant(std::nan("")), z), std::invalid_argument);
}

TEST(Heading, IsTheAzimuthOfTheImageXAxis) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  // For a view along +y with z up, the image's x axis is +x.
  EXPECT_NEAR(heading_rad(look_at({0, 0, 0}, {0, 1, 0}, z)), 0, 1e-15);
  EXPECT_NEAR(heading_rad(look_at({0, 0, 0}, {-1, 0, 0}, z)), pi / 2, 1e-15);
  // For a view straight up, rotated by each angle.
  for (const double angle : {-3.0, -0.5, 0.0, 1.0, pi}) {
    const Rigid3 world_from_cam{so3_exp({0, 0, angle}), {1, 2, 0}};
    EXPECT_NEAR(heading_rad(world_from_cam.inverse()), angle, 1e-14);
  }
  Rigid3 half_turn;  // atan2 of a negative zero must not give -pi
  half_turn.rotation.diagonal() << -1, -1, 1;
  half_turn.rotation(0, 1) = -0.0;
  EXPECT_EQ(heading_rad(half_turn), pi);
}

}  // namespace
}  // namespace occ
