// SPDX-License-Identifier: Apache-2.0
// Covariance and information of the pose from the normal equations of eight unknowns.
#include "libocc/refine/internal/pose_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "libocc/refine/internal/prior_rows.hpp"
#include "tests/support/support.hpp"

namespace occ {
using namespace internal::refine;
namespace {

using Rows = Eigen::Matrix<double, Eigen::Dynamic, 8>;

const Eigen::Vector3d far_pivot{0.4, -0.7, 2.6};

/// Random rows by a left perturbation of the pose, growth and log_factor.
Rows random_rows(Random& random, int count, bool of_pose_only = false) {
  Rows rows(count, 8);
  for (Eigen::Index i = 0; i < rows.size(); ++i) rows.data()[i] = random.normal();
  if (of_pose_only) rows.rightCols<2>().setZero();
  return rows;
}

/// Sums of rows whose rotation is about the pivot: a left perturbation (w, v) is the rotation w
/// about p and the shift v + w x p.
PoseNormalEquations sums_about_pivot(const Rows& rows) {
  PoseNormalEquations normal;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    Vector8 row = rows.row(i).transpose();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d shift = Eigen::Vector3d::Unit(k).cross(far_pivot);
      row[k] -= shift.dot(Eigen::Vector3d(rows.row(i).segment<3>(3)));
    }
    normal.add(row, 0);
  }
  return normal;
}

/// Information of the pose without what growth and log_factor could explain: the rows' projection
/// onto the complement of their columns.
Matrix6 projected_information(const Rows& rows) {
  const Eigen::MatrixXd own = rows.rightCols<2>();
  Eigen::MatrixXd left = rows.leftCols<6>();
  if (!own.isZero(0)) left -= own * own.colPivHouseholderQr().solve(left);
  return left.transpose() * left;
}

void expect_close(const Matrix6& a, const Matrix6& b, double relative = 1e-10) {
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), relative * b.cwiseAbs().maxCoeff()) << a << "\n\n" << b;
}

TEST(PoseCovariance, MarginalisesTheLightAndTheGrowth) {
  Random random(1, 0);
  for (int i = 0; i < 20; ++i) {
    const Rows rows = random_rows(random, 14);
    const Matrix6 expected = projected_information(rows);
    const PoseNormalEquations normal = sums_about_pivot(rows);
    expect_close(pose_information(normal, far_pivot), expected);
    const PoseCovariance pose = pose_covariance(normal, far_pivot);
    EXPECT_EQ(pose.rank, 6);
    expect_close(pose.covariance, expected.inverse(), 1e-8);
  }
}

TEST(PoseCovariance, IsZeroWithTheRankOfTheDirectionsThatAreDetermined) {
  Random random(2, 0);
  for (int rank = 1; rank < 6; ++rank) {
    Rows rows = random_rows(random, 12, true);
    const Eigen::MatrixXd kept = random_rows(random, rank, true).leftCols<6>();
    rows.leftCols<6>() *= kept.transpose() * kept;
    rows.col(6).setOnes();
    rows.col(7).setLinSpaced(-1, 1);
    const PoseCovariance pose = pose_covariance(sums_about_pivot(rows), far_pivot);
    EXPECT_EQ(pose.rank, rank);
    EXPECT_TRUE(pose.covariance.isZero(0));
  }
  // Rows of the rotation or of the translation alone give no scale for the other.
  for (const int first : {0, 3}) {
    PoseNormalEquations normal;
    for (int k = 0; k < 3; ++k) normal.add(Vector8::Unit(first + k), 0);
    EXPECT_EQ(pose_covariance(normal, far_pivot).rank, 0);
    EXPECT_TRUE(pose_covariance(normal, far_pivot).covariance.isZero(0));
  }
}

TEST(PoseCovariance, AcceptsWeakDirectionsAndAnyUnits) {
  // Growth, log_factor and the pose without correlations: the variances are the inverses.
  Vector8 information;
  information << 4e6, 1e6, 2e6, 3e-7, 5e-7, 2e-7, 3, 7;
  information[2] *= 1e-13;  // as of a weak prior
  PoseNormalEquations normal;
  for (int k = 0; k < 8; ++k) normal.add(std::sqrt(information[k]) * Vector8::Unit(k), 0);
  const PoseCovariance pose = pose_covariance(normal, Eigen::Vector3d::Zero());
  ASSERT_EQ(pose.rank, 6);
  for (int k = 0; k < 6; ++k)
    EXPECT_NEAR(pose.covariance(k, k) * information[k], 1, 1e-9) << "unknown " << k;
}

TEST(LampInformation, IsThatOfTheLampsWithoutThePrior) {
  Random random(3, 0);
  for (int i = 0; i < 10; ++i) {
    const Rows lamps = random_rows(random, 14), prior_rows = random_rows(random, 6, true);
    Rows all(lamps.rows() + prior_rows.rows(), 8);
    all << lamps, prior_rows;
    const Matrix6 found =
        lamp_information(sums_about_pivot(all), sums_about_pivot(prior_rows), far_pivot);
    expect_close(found, projected_information(lamps), 1e-9);
  }
}

TEST(LampInformation, IsSemidefiniteAndZeroWhereAPriorHidesTheLamps) {
  Random random(4, 0);
  const Rows lamps = random_rows(random, 9, true);
  Rows prior_rows = Rows::Zero(1, 8);
  prior_rows(0, 3) = 1e9;  // leaves rounding errors of 100 along x
  Rows all(10, 8);
  all << lamps, prior_rows;
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  PoseNormalEquations normal, prior;
  for (Eigen::Index i = 0; i < all.rows(); ++i) normal.add(all.row(i).transpose(), 0);
  for (int k = 6; k < 8; ++k) normal.add(Vector8::Unit(k), 0);
  prior.add(prior_rows.row(0).transpose(), 0);
  const Matrix6 found = lamp_information(normal, prior, origin);
  const Eigen::SelfAdjointEigenSolver<Matrix6> eigen(found);
  EXPECT_GT(eigen.eigenvalues()[0], -1e-9);
  // The five other directions are those of the lamps with the first one known.
  Eigen::Matrix<double, 5, 5> others;
  const int kept[] = {0, 1, 2, 4, 5};
  for (int r = 0; r < 5; ++r)
    for (int c = 0; c < 5; ++c)
      others(r, c) = lamps.col(kept[r]).dot(lamps.col(kept[c])) - found(kept[r], kept[c]);
  EXPECT_LT(others.cwiseAbs().maxCoeff(), 1e-3);
  EXPECT_LT(std::abs(found(3, 3)), 50);
  EXPECT_TRUE(lamp_information(PoseNormalEquations{}, prior, origin).isZero(0));
}

TEST(PriorRows, AreTakenAboutThePivot) {
  const Rigid3 pose{so3_exp({0.2, -0.1, 0.4}), {0.3, 0.5, 1.2}};
  Prior prior;
  prior.position_m = pose.origin_in_source() + Eigen::Vector3d(0.1, 0, -0.2);
  prior.position_sigma_m = 0.05;
  PoseNormalEquations normal;
  add_prior(prior, pose, far_pivot, normal);
  // chi2 of the prior at a step about the pivot, from its rows at the moved pose.
  const auto chi2 = [&](const Vector8& step) {
    return prior.rows(moved({pose}, far_pivot, step).cam_from_world).residuals.squaredNorm();
  };
  EXPECT_NEAR(normal.chi2, chi2(Vector8::Zero()), 1e-12);
  EXPECT_NEAR(normal.chi2, 20.0, 1e-9);
  for (int k = 0; k < 8; ++k) {
    const Vector8 by = 1e-5 * Vector8::Unit(k);
    EXPECT_NEAR(normal.gradient[k], (chi2(by) - chi2(-by)) / 4e-5, 1e-5) << k;
  }
}

}  // namespace
}  // namespace occ
