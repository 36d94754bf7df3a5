// SPDX-License-Identifier: Apache-2.0
// Checks and square roots of covariance matrices: units, rounding errors, singular matrices.
#include "libocc/core/internal/covariance.hpp"

#include "tests/support/support.hpp"

namespace occ::internal::core {
namespace {

std::string fault(const Matrix6& a) {
  return test::complaint([&] { require_semidefinite(a, "options.covariance"); });
}

Matrix6 random_matrix(std::uint64_t seed) {
  Random random(seed);
  return Matrix6::NullaryExpr([&] { return random.normal(); });
}

TEST(CoreCovariance, NamesTheFieldAndTheValue) {
  Matrix6 a = Matrix6::Identity();
  EXPECT_EQ(fault(a), "");
  EXPECT_EQ(fault(Matrix6::Zero()), "");
  a(1, 0) = 0.25;
  EXPECT_EQ(fault(a).find("options.covariance must be symmetric, got    1"), 0u) << fault(a);
  EXPECT_NE(fault(a).find("0.25"), std::string::npos);
  a(0, 1) = a(1, 0) = 1.5;
  EXPECT_EQ(fault(a).find("options.covariance must be positive semi-definite"), 0u) << fault(a);
  a(1, 0) = std::nan("");
  EXPECT_EQ(fault(a).find("options.covariance must be finite"), 0u) << fault(a);
  EXPECT_NE(fault(-Matrix6::Identity()), "");
  Matrix6 one_negative = Matrix6::Identity();
  one_negative(5, 5) = -1e-3;
  EXPECT_NE(fault(one_negative), "");
  Matrix6 off_diagonal = Matrix6::Zero();
  off_diagonal(0, 1) = off_diagonal(1, 0) = 1;
  EXPECT_NE(fault(off_diagonal), "");
}

TEST(CoreCovariance, DoesNotDependOnUnits) {
  Eigen::Matrix<double, 6, 1> unit;
  unit << 1e-4, 2e-4, 1e-3, 10, 20, 5;
  Matrix6 a = Matrix6::Identity();
  a(0, 1) = a(1, 0) = 1.1;
  EXPECT_NE(fault(unit.asDiagonal() * a * unit.asDiagonal()), "");
  a(0, 1) = a(1, 0) = 0.9;
  EXPECT_EQ(fault(unit.asDiagonal() * a * unit.asDiagonal()), "");
}

TEST(CoreCovariance, RoundingErrorsOfSinglePrecisionAreAccepted) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const int rank = 1 + static_cast<int>(seed % 5);
    const auto rows = random_matrix(seed).topRows(rank).cast<float>().eval();
    const Matrix6 singular = (rows.transpose() * rows).cast<double>();
    EXPECT_EQ(fault(singular), "");
    EXPECT_EQ(fault(1e-20 * singular), "");
  }
}

TEST(CoreCovariance, DefiniteMatricesHaveNoZeroEigenvalue) {
  const auto fault_of = [](const Matrix6& a) {
    return test::complaint([&] { require_positive_definite(a, "covariance"); });
  };
  EXPECT_EQ(fault_of(1e-30 * Matrix6::Identity()), "");
  EXPECT_EQ(fault_of(Matrix6::Zero()).find("covariance must be positive definite"), 0u);
  EXPECT_EQ(fault_of(Matrix6::Ones()).find("covariance must be positive definite"), 0u);
  EXPECT_EQ(fault_of(Matrix6::Identity() + 1e-3 * Matrix6(random_matrix(1)))
                .find("covariance must be symmetric"),
            0u);
}

TEST(CoreCovariance, TheRootOfASingularMatrixReproducesIt) {
  for (int rank = 0; rank <= 6; ++rank) {
    const Matrix6 rows = random_matrix(static_cast<std::uint64_t>(rank));
    const Matrix6 a = rows.topRows(rank).transpose() * rows.topRows(rank);
    const Matrix6 root = semidefinite_root(a);
    EXPECT_LT((root.transpose() * root - a).norm(), 1e-14 * (1 + a.norm())) << "rank " << rank;
  }
}

}  // namespace
}  // namespace occ::internal::core
