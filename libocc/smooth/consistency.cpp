// SPDX-License-Identifier: Apache-2.0
#include "libocc/smooth/consistency.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"

namespace occ {
namespace {

constexpr Eigen::Index min_runs = 10;  // the variance of their means is then known to 50 %

/// Interval of a mean of values with `dof` degrees of freedom in total, in units of its
/// expectation.
std::pair<double, double> interval(double dof, double confidence) {
  const double tail = 0.5 * (1 - confidence);
  return {chi2_quantile(tail, dof) / dof, chi2_quantile(1 - tail, dof) / dof};
}

void check(const Eigen::MatrixXd& squared, const Eigen::MatrixXi& dof, double confidence) {
  require(squared.rows() == dof.rows() && squared.cols() == dof.cols(), "dof",
          std::to_string(dof.rows()) + " x " + std::to_string(dof.cols()), "of squared's shape");
  require(confidence > 0 && confidence < 1, "confidence", confidence, "in (0, 1)");
  for (Eigen::Index time = 0; time < squared.cols(); ++time) {
    for (Eigen::Index run = 0; run < squared.rows(); ++run) {
      const std::string place = "[" + std::to_string(run) + ", " + std::to_string(time) + "]";
      require(dof(run, time) >= 0, "dof" + place, dof(run, time), "at least 0");
      require(squared(run, time) >= 0 && std::isfinite(squared(run, time)), "squared" + place,
              squared(run, time), "finite and at least 0");
    }
  }
  require(dof.size() > 0 && dof.maxCoeff() > 0, "dof", 0, "positive somewhere");
}

/// Degrees of freedom of the overall mean for correlated values in each run.
double dependent_dof(const Eigen::MatrixXd& squared, const Eigen::MatrixXi& dof, double all_dof) {
  std::vector<double> means;
  for (Eigen::Index run = 0; run < squared.rows(); ++run) {
    const double run_dof = dof.row(run).cast<double>().sum();
    if (run_dof > 0) means.push_back(squared.row(run).sum() / run_dof);
  }
  const auto runs = static_cast<double>(means.size());
  const double of_one_time = all_dof / static_cast<double>(std::max<Eigen::Index>(1, dof.cols()));
  if (means.size() < static_cast<std::size_t>(min_runs)) return of_one_time;
  double mean = 0, variance = 0;
  for (const double value : means) mean += value / runs;
  for (const double value : means) variance += (value - mean) * (value - mean) / (runs - 1);
  // In units of the measured mean: a wrong scale does not change nu.
  variance /= mean * mean;
  return std::clamp(2 * runs / variance, of_one_time, all_dof);
}

ConsistencyReport report(const Eigen::MatrixXd& values, const Eigen::MatrixXi& dof,
                         double confidence, bool dependent) {
  check(values, dof, confidence);
  const Eigen::MatrixXd squared = (dof.array() > 0).select(values, 0);
  ConsistencyReport out;
  const double all_dof = dof.cast<double>().sum();
  out.count = static_cast<int>((dof.array() > 0).count());
  out.mean = squared.sum() / all_dof;
  out.effective_dof = dependent && out.mean > 0 ? dependent_dof(squared, dof, all_dof) : all_dof;
  std::tie(out.low, out.high) = interval(out.effective_dof, confidence);
  if (out.mean > out.high) out.verdict = Consistency::optimistic;
  if (out.mean < out.low) out.verdict = Consistency::pessimistic;
  out.mean_at = out.low_at = out.high_at = Eigen::VectorXd::Zero(squared.cols());
  int inside = 0, times = 0;
  for (Eigen::Index time = 0; time < squared.cols(); ++time) {
    const double time_dof = dof.col(time).cast<double>().sum();
    if (time_dof == 0) continue;
    ++times;
    out.mean_at[time] = squared.col(time).sum() / time_dof;
    std::tie(out.low_at[time], out.high_at[time]) = interval(time_dof, confidence);
    inside += out.mean_at[time] >= out.low_at[time] && out.mean_at[time] <= out.high_at[time];
  }
  out.share_inside = static_cast<double>(inside) / times;
  return out;
}

}  // namespace

const char* to_string(Consistency verdict) {
  switch (verdict) {
    case Consistency::optimistic:
      return "optimistic";
    case Consistency::pessimistic:
      return "pessimistic";
    default:
      return "consistent";
  }
}

double normalised_squared_error(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance) {
  require(covariance.rows() == error.size() && covariance.cols() == error.size(), "covariance",
          std::to_string(covariance.rows()) + " x " + std::to_string(covariance.cols()),
          "square and of the error's size");
  require(error.allFinite(), "error", error.transpose(), "finite");
  require(covariance.allFinite(), "covariance", covariance, "finite");
  // Scaled to a unit diagonal: rounding does not depend on the units (metres and radians).
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  require((sigma.array() > 0).all(), "covariance", covariance, "positive definite");
  const Eigen::VectorXd unit = sigma.cwiseInverse();
  const internal::core::Cholesky<Eigen::MatrixXd> cholesky(unit.asDiagonal() * covariance *
                                                           unit.asDiagonal());
  require(cholesky.exists(), "covariance", covariance, "positive definite");
  return cholesky.solve_lower<Eigen::VectorXd>(unit.cwiseProduct(error)).squaredNorm();
}

ConsistencyReport nees(const Eigen::MatrixXd& squared, const Eigen::MatrixXi& dof,
                       double confidence) {
  return report(squared, dof, confidence, true);
}

ConsistencyReport nis(const Eigen::MatrixXd& squared, const Eigen::MatrixXi& dof,
                      double confidence) {
  return report(squared, dof, confidence, false);
}

}  // namespace occ
