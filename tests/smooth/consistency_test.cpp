// SPDX-License-Identifier: Apache-2.0
// Chi-square probabilities and quantiles; NEES and NIS of estimators that are right and wrong.
#include "libocc/smooth/consistency.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "libocc/core/statistics.hpp"
#include "tests/support/support.hpp"

namespace occ::test {
namespace {

TEST(ChiSquare, QuantilesOfTheTables) {
  EXPECT_NEAR(chi2_quantile(0.95, 1), 3.841458820694124, 1e-9);
  EXPECT_NEAR(chi2_quantile(0.99, 2), -2 * std::log(0.01), 1e-9);
  EXPECT_NEAR(chi2_quantile(0.025, 6), 1.2373442457912027, 1e-9);
  EXPECT_NEAR(chi2_quantile(0.975, 6), 14.449375335447922, 1e-9);
  EXPECT_NEAR(chi2_quantile(1 - 1e-12, 2), -2 * std::log(1e-12), 2e-4);
  EXPECT_EQ(chi2_quantile(0, 3), 0);
  for (const double dof : {0.3, 1.0, 6.0, 500.0, 48000.0})
    for (const double p : {1e-6, 0.025, 0.5, 0.9, 0.99999})
      EXPECT_NEAR(chi2_probability(chi2_quantile(p, dof), dof), p, 1e-9) << dof;
}

TEST(ChiSquare, ProbabilityInClosedForm) {
  for (const double x : {0.0, 0.1, 1.0, 3.9, 4.1, 20.0, 300.0}) {
    EXPECT_NEAR(chi2_probability(x, 2), 1 - std::exp(-x / 2), 1e-14);
    EXPECT_NEAR(chi2_probability(x, 4), 1 - std::exp(-x / 2) * (1 + x / 2), 1e-14);
    EXPECT_NEAR(chi2_probability(x, 1), std::erf(std::sqrt(x / 2)), 1e-14);
  }
  EXPECT_EQ(chi2_probability(std::numeric_limits<double>::infinity(), 3), 1);
  EXPECT_NE(complaint([] { chi2_quantile(1, 3); }), "");
  EXPECT_NE(complaint([] { chi2_probability(-1, 3); }), "");
  EXPECT_NE(complaint([] { chi2_probability(1, 0); }), "");
}

TEST(Consistency, SquaredErrorDoesNotDependOnUnits) {
  Random random(1);
  Eigen::MatrixXd root(4, 6);
  for (int i = 0; i < 24; ++i) root(i % 4, i / 4) = random.normal();
  const Eigen::MatrixXd covariance = root * root.transpose();
  const Eigen::Vector4d error(1, -2, 0.5, 3), units(1e-9, 1, 1e6, 1e12);
  const double squared = normalised_squared_error(error, covariance);
  EXPECT_NEAR(squared, error.dot(covariance.inverse() * error), 1e-9 * squared);
  EXPECT_NEAR(normalised_squared_error(units.cwiseProduct(error),
                                       units.asDiagonal() * covariance * units.asDiagonal()),
              squared, 1e-9 * squared);
  EXPECT_NE(complaint([&] { normalised_squared_error(error, -covariance); }), "");
  EXPECT_NE(complaint([&] { normalised_squared_error(error.head(2), covariance); }), "");
  EXPECT_NE(complaint([&] { normalised_squared_error(NAN * error, covariance); }), "");
}

/// First-order autoregressive errors of `size` components, their sigma `scale` times as stated.
Eigen::MatrixXd squares(Random& random, int runs, int times, int size, double memory,
                        double scale) {
  Eigen::MatrixXd out(runs, times);
  for (int run = 0; run < runs; ++run) {
    Eigen::VectorXd error(size);
    for (int k = 0; k < times; ++k) {
      for (int i = 0; i < size; ++i)
        error[i] = k == 0 ? random.normal()
                          : memory * error[i] + std::sqrt(1 - memory * memory) * random.normal();
      out(run, k) = scale * scale * error.squaredNorm();
    }
  }
  return out;
}

TEST(Consistency, DetectsWrongCovariances) {
  Random random(2);
  const Eigen::MatrixXi dof = Eigen::MatrixXi::Constant(50, 40, 3);
  const auto verdict = [&](double memory, double scale) {
    return nees(squares(random, 50, 40, 3, memory, scale), dof, 0.99).verdict;
  };
  for (const double memory : {0.0, 0.9}) {
    EXPECT_EQ(verdict(memory, 1), Consistency::consistent);
    EXPECT_EQ(verdict(memory, 1.2), Consistency::optimistic);
    EXPECT_EQ(verdict(memory, 0.8), Consistency::pessimistic);
  }
  const auto one_run = nis(squares(random, 1, 500, 2, 0, 1), Eigen::MatrixXi::Constant(1, 500, 2));
  EXPECT_EQ(one_run.effective_dof, 1000);
  EXPECT_NEAR(one_run.share_inside, 0.95, 0.04);
  EXPECT_STREQ(to_string(Consistency::optimistic), "optimistic");
}

// The interval must have its nominal coverage for errors that are correlated in time as well.
// Computed for independent errors, it rejects a consistent estimator in one of three runs.
TEST(Consistency, IntervalsHoldForCorrelatedErrors) {
  Random random(3);
  constexpr int trials = 300;
  const Eigen::MatrixXi dof = Eigen::MatrixXi::Constant(30, 30, 2);
  int held = 0, held_if_independent = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const Eigen::MatrixXd squared = squares(random, 30, 30, 2, 0.9, 1);
    held += nees(squared, dof).verdict == Consistency::consistent;
    held_if_independent += nis(squared, dof).verdict == Consistency::consistent;
  }
  EXPECT_GT(held, 0.90 * trials);
  EXPECT_LT(held, 0.99 * trials);
  EXPECT_LT(held_if_independent, 0.75 * trials);
}

TEST(Consistency, ValuesMayBeMissing) {
  Eigen::MatrixXd squared(2, 3);
  squared << 2, 0, 4, 1, 0, 99;
  Eigen::MatrixXi dof(2, 3);
  dof << 2, 0, 4, 2, 0, 0;
  const auto report = nis(squared, dof);
  EXPECT_EQ(report.count, 3);
  EXPECT_DOUBLE_EQ(report.mean, 7.0 / 8);
  EXPECT_EQ(report.mean_at[1], 0);
  EXPECT_DOUBLE_EQ(report.mean_at[2], 1);
  EXPECT_NEAR(report.low, chi2_quantile(0.025, 8) / 8, 1e-12);
  EXPECT_NE(complaint([&] { nis(squared, dof.topRows(1)); }), "");
  EXPECT_NE(complaint([&] { nis(squared, 0 * dof); }), "");
  EXPECT_NE(complaint([&] { nis(-squared, dof); }), "");
  EXPECT_NE(complaint([&] { nis(squared, dof, 1); }), "");
}

}  // namespace
}  // namespace occ::test
