// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/photometry/internal/response_fit.hpp"

namespace occ::internal::photometry {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int max_level_steps = 30;
constexpr double first_smoothness = 100;  // continuation from a stiff curve
constexpr double start_sigma = 0.02;      // of eq (3) at weight 1
constexpr double tolerance = 0.01;        // of chi2: far below its standard deviation

/// Position of a level between the curve's levels: g(level) = (1 - part) g_k + part g_{k+1}.
struct Interpolation {
  Index k = 0;
  double part = 0;
};

class LevelFit {
 public:
  LevelFit(const PatchSeries& series, ChannelResponse& response)
      : series_(series),
        r_(response),
        u_((response.level_dn.array() - response.black_level_dn).log()) {
    middle_ = between(0.5 * (r_.black_level_dn + r_.full_scale_dn)).k;
    r_.log_exposure = u_.array() - u_[middle_];
  }

  /// False without convergence.
  bool run(double smoothness) {
    start();
    for (double lambda = std::max(smoothness, first_smoothness);; lambda /= 3) {
      const bool last = lambda <= smoothness;
      set_smoothness(last ? smoothness : lambda);
      const bool converged = minimise();
      if (!last) continue;
      compute_covariance();
      write_residuals();
      return converged;
    }
  }

 private:
  Interpolation between(double level) const {
    const double u = std::log(std::max(level - r_.black_level_dn, 1e-9));
    const auto above = std::upper_bound(u_.data() + 1, u_.data() + u_.size() - 1, u);
    const Index k = above - u_.data() - 1;
    return {k, (u - u_[k]) / (u_[k + 1] - u_[k])};
  }

  /// Hat weight of eq (3), 1 at the middle level; the lower bound keeps a prior at the ends.
  double hat(double level) const {
    const double half = 0.5 * (r_.full_scale_dn - r_.black_level_dn);
    return std::max(0.02, 1 - std::abs(level - r_.black_level_dn - half) / half);
  }

  void set_smoothness(double lambda) {
    const Index n = u_.size();
    prior_ = MatrixXd::Zero(n, n);
    for (Index k = 1; k + 1 < n; ++k) {
      const double before = u_[k] - u_[k - 1], after = u_[k + 1] - u_[k];
      const double width = 0.5 * (before + after);
      const Eigen::Vector3d second(1 / (before * width), -(1 / before + 1 / after) / width,
                                   1 / (after * width));
      const double weight = lambda * lambda * width * std::pow(hat(r_.level_dn[k]), 2);
      prior_.block<3, 3>(k - 1, k - 1) += weight * second * second.transpose();
    }
  }

  /// Start: eq (3) with its weights.
  void start() {
    set_smoothness(first_smoothness);
    solve(first_rows());
    for (Index i = 0; i < log_light_.size(); ++i) {
      const FlatPatch& patch = series_.patches[i];
      double sum = 0;
      for (const PatchLevel& p : patch.levels) sum += value(p.level_dn) - log_time(p);
      log_light_[i] = sum / static_cast<double>(patch.levels.size());
    }
  }

  /// Gauss-Newton steps, halved while the cost increases.
  bool minimise() {
    double cost = cost_now();
    for (int step = 0; step < max_level_steps; ++step) {
      const VectorXd g = r_.log_exposure, light = log_light_;
      solve(rows());
      const VectorXd d_g = r_.log_exposure - g, d_light = log_light_ - light;
      double part = 1, next = cost_now();
      while (next > cost * (1 + 1e-9) && part > 1e-3) {
        part /= 2;
        log_light_ = light + part * d_light;
        set_curve(g + part * d_g);
        next = cost_now();
      }
      if (next > cost) {
        log_light_ = light;
        set_curve(g);
        return true;  // the piecewise linear curve has kinks, so the cost may not decrease further
      }
      const bool converged = cost - next < tolerance;
      cost = next;
      if (converged) return true;
    }
    return false;
  }

  void set_curve(const VectorXd& g) {
    r_.log_exposure = g;
    rising_ = g;
    for (Index k = 1; k < g.size(); ++k) rising_[k] = std::max(rising_[k], rising_[k - 1]);
  }

  double cost_now() const {
    double sum = r_.log_exposure.dot(prior_ * r_.log_exposure);
    for (std::size_t i = 0; i < series_.patches.size(); ++i)
      for (const PatchLevel& p : series_.patches[i].levels) {
        const Prediction s = predict(p, log_light_[static_cast<Index>(i)]);
        sum += std::pow(s.difference / s.sigma, 2);
      }
    return sum;
  }

  /// dg/du at a level.
  double slope(double level) const {
    const Index k = between(level).k;
    return (rising_[k + 1] - rising_[k]) / (u_[k + 1] - u_[k]);
  }
  double value(double level) const {
    const Interpolation b = between(level);
    return (1 - b.part) * r_.log_exposure[b.k] + b.part * r_.log_exposure[b.k + 1];
  }

  /// Level at which the rising curve has a value.
  double inverse(double g) const {
    const auto above = std::upper_bound(rising_.data() + 1, rising_.data() + rising_.size() - 1, g);
    const Index k = above - rising_.data() - 1;
    const double step = rising_[k + 1] - rising_[k];
    const double part = step > 0 ? (g - rising_[k]) / step : 0.5;
    return r_.black_level_dn + std::exp(u_[k] + std::clamp(part, -1.0, 2.0) * (u_[k + 1] - u_[k]));
  }

  double log_time(const PatchLevel& p) const { return std::log(series_.exposures_s[p.exposure]); }

  /// Equation g(level) - ln E = y with standard deviation sigma.
  struct Row {
    Interpolation at;
    double y = 0, sigma = 1;
  };
  using Rows = std::vector<std::vector<Row>>;  // one list per patch

  /// Equations (3).
  Rows first_rows() const {
    Rows all;
    for (const FlatPatch& patch : series_.patches) {
      all.emplace_back();
      for (const PatchLevel& p : patch.levels)
        all.back().push_back({between(p.level_dn), log_time(p), start_sigma / hat(p.level_dn)});
    }
    return all;
  }

  /// Predicted level of a patch in an image, and the difference from the observed one.
  struct Prediction {
    double expected_dn = 0;  // z = f(E t)
    double difference = 0;   // observed - expected, in g: g' (Z - z)
    double sigma = 1;        // standard deviation of the difference
  };

  /// The curvature of the response shifts the mean level by -(g'' + g'^2) / (2 g') times the noise
  /// variance; g'' is approximated by that of a power law.
  Prediction predict(const PatchLevel& p, double log_light) const {
    constexpr double exact = 1e-6;  // lower bound of sigma, for images without noise
    const double black = r_.black_level_dn;
    const double z = std::clamp(inverse(log_light + log_time(p)), 0.5 * (p.level_dn + black),
                                std::min(2 * p.level_dn - black, r_.full_scale_dn));
    const double log_slope = std::max(slope(z), 0.05), signal = z - black;
    const double curvature_dn = 0.5 * log_slope * (log_slope - 1) * p.pixel_dn2 / (signal * signal);
    return {z, log_slope * (p.level_dn - z) / signal + curvature_dn,
            std::max(exact, log_slope * std::sqrt(p.variance_dn2) / signal)};
  }

  /// Equations linearised at the expected levels, so that noise does not enter their coefficients
  /// (least squares in the levels, not in g of the levels).
  Rows rows() const {
    Rows all;
    for (std::size_t i = 0; i < series_.patches.size(); ++i) {
      all.emplace_back();
      for (const PatchLevel& p : series_.patches[i].levels) {
        const Prediction s = predict(p, log_light_[static_cast<Index>(i)]);
        all.back().push_back({between(s.expected_dn), log_time(p) - s.difference, s.sigma});
      }
    }
    return all;
  }

  /// Linear least squares with the light of each patch eliminated; g of the middle level is held at
  /// 0.
  void solve(const Rows& rows) {
    const Index n = u_.size(), patches = static_cast<Index>(rows.size());
    data_ = MatrixXd::Zero(n, n);
    VectorXd right = VectorXd::Zero(n), weights = VectorXd::Zero(patches), observed = weights;
    std::vector<std::vector<std::pair<Index, double>>> shares(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto patch = static_cast<Index>(i);
      for (const Row& row : rows[i]) {
        const double weight = 1 / (row.sigma * row.sigma);
        const std::array<std::pair<Index, double>, 2> parts{
            {{row.at.k, 1 - row.at.part}, {row.at.k + 1, row.at.part}}};
        for (const auto& [j, part] : parts) {
          right[j] += weight * part * row.y;
          for (const auto& [k, other] : parts) data_(j, k) += weight * part * other;
          shares[i].emplace_back(j, weight * part);
        }
        weights[patch] += weight;
        observed[patch] += weight * row.y;
      }
      for (const auto& [j, share] : shares[i]) {
        right[j] -= share * observed[patch] / weights[patch];
        for (const auto& [k, other] : shares[i]) data_(j, k) -= share * other / weights[patch];
      }
    }
    solve_normal(right);
    log_light_ = -observed;
    for (std::size_t i = 0; i < rows.size(); ++i)
      for (const auto& [j, share] : shares[i])
        log_light_[static_cast<Index>(i)] += share * r_.log_exposure[j];
    log_light_ = log_light_.cwiseQuotient(weights);
  }

  void solve_normal(VectorXd& right) {
    MatrixXd normal = data_ + prior_;
    hold_middle(normal, right);
    set_curve(core::solve_ldlt(normal, right));
  }

  void compute_covariance() {
    const VectorXd g = r_.log_exposure, light = log_light_;
    solve(rows());
    set_curve(g);
    log_light_ = light;
    const Index n = u_.size();
    MatrixXd normal = data_ + prior_;
    VectorXd zero = VectorXd::Zero(n);
    hold_middle(normal, zero);
    covariance_ = core::solve_ldlt<MatrixXd, MatrixXd>(normal, MatrixXd::Identity(n, n));
    covariance_.row(middle_).setZero();
    covariance_.col(middle_).setZero();
    determined_ = covariance_.cwiseProduct(data_).sum();
  }

  void hold_middle(MatrixXd& normal, VectorXd& right) const {
    normal.row(middle_).setZero();
    normal.col(middle_).setZero();
    normal(middle_, middle_) = 1;
    right[middle_] = 0;
  }

  void write_residuals() {
    r_.chi2 = 0;
    double count = 0;
    for (std::size_t i = 0; i < series_.patches.size(); ++i) {
      const FlatPatch& patch = series_.patches[i];
      const double log_light = log_light_[static_cast<Index>(i)];
      for (const PatchLevel& p : patch.levels) {
        const Prediction s = predict(p, log_light);
        r_.chi2 += std::pow(s.difference / s.sigma, 2);
        r_.residuals.push_back({p.exposure,
                                {patch.x, patch.y},
                                p.level_dn,
                                log_light + log_time(p),
                                s.difference,
                                s.sigma});
      }
      count += static_cast<double>(patch.levels.size()) - 1;
    }
    r_.dof = static_cast<int>(std::lround(count - determined_));
    r_.variance_factor = variance_factor(r_.chi2, r_.dof);
    r_.covariance = r_.variance_factor * covariance_;
  }

  const PatchSeries& series_;
  ChannelResponse& r_;
  VectorXd u_;
  Index middle_ = 0;
  MatrixXd prior_, data_, covariance_;
  VectorXd log_light_, rising_;  // rising_: running maximum of the curve
  double determined_ = 0;        // number of parameters determined by the data, not by the prior
};

}  // namespace

VectorXd curve_levels(const LevelRange& range) {
  constexpr int max_levels = 256;
  const double first = std::floor(range.black_dn) + 1;
  const int levels = static_cast<int>(range.full_scale_dn - first) + 1;
  std::vector<double> chosen;
  for (int k = 0; k < std::min(levels, max_levels); ++k) {
    // Every level of 8 bits; for deeper images, intervals of at least 1 that grow linearly with k.
    const double square = (levels - 1) * std::pow(k / (max_levels - 1.0), 2);
    chosen.push_back(first + (levels <= max_levels ? k : std::round(std::max<double>(k, square))));
  }
  return Eigen::Map<const VectorXd>(chosen.data(), static_cast<Index>(chosen.size()));
}

bool fit_levels(const PatchSeries& series, double smoothness, ChannelResponse& response) {
  return LevelFit(series, response).run(smoothness);
}

}  // namespace occ::internal::photometry
