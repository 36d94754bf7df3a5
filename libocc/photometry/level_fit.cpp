// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/statistics.hpp"
#include "libocc/photometry/internal/response_fit.hpp"

namespace occ::internal::photometry {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int max_steps = 30;
constexpr double first_smoothness = 100;  // from a stiff curve to as soft a one as is asked for
constexpr double start_sigma = 0.02;      // of eq (3) where its weight is 1
constexpr double tolerance = 0.01;        // of chi2: far below chance

/// A level's place among the curve's: g(level) = (1 - part) g_k + part g_{k+1}.
struct Between {
  Index k = 0;
  double part = 0;
};

class LevelFit {
 public:
  LevelFit(const SeriesPlaces& series, ChannelResponse& response)
      : series_(series),
        r_(response),
        u_((response.level_dn.array() - response.black_level_dn).log()) {
    middle_ = between(0.5 * (r_.black_level_dn + r_.full_scale_dn)).k;
    r_.log_exposure = u_.array() - u_[middle_];
  }

  /// False when the steps come to no end.
  bool run(double smoothness) {
    start();
    for (double lambda = std::max(smoothness, first_smoothness);; lambda /= 3) {
      const bool last = lambda <= smoothness;
      set_smoothness(last ? smoothness : lambda);
      const bool converged = minimise();
      if (!last) continue;
      state_covariance();
      state_residuals();
      return converged;
    }
  }

 private:
  Between between(double level) const {
    const double u = std::log(std::max(level - r_.black_level_dn, 1e-9));
    const auto above = std::upper_bound(u_.data() + 1, u_.data() + u_.size() - 1, u);
    const Index k = above - u_.data() - 1;
    return {k, (u - u_[k]) / (u_[k + 1] - u_[k])};
  }

  /// Eq (3)'s hat, 1 at the middle level.
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

  /// By eq (3)'s weights, in units of an error that counts little against smoothness.
  void start() {
    set_smoothness(first_smoothness);
    solve(first_rows());
    for (Index i = 0; i < log_light_.size(); ++i) {
      const FlatPlace& place = series_.places[i];
      double sum = 0;
      for (const PlaceLevel& p : place.levels) sum += value(p.level_dn) - log_time(p);
      log_light_[i] = sum / static_cast<double>(place.levels.size());
    }
  }

  /// Gauss and Newton's steps, halved while they make it worse.
  bool minimise() {
    double cost = cost_now();
    for (int step = 0; step < max_steps; ++step) {
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
        return true;  // as low as kinks of the curve let it come
      }
      const bool still = cost - next < tolerance;
      cost = next;
      if (still) return true;
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
    for (std::size_t i = 0; i < series_.places.size(); ++i)
      for (const PlaceLevel& p : series_.places[i].levels) {
        const Shown s = shown(p, log_light_[static_cast<Index>(i)]);
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
    const Between b = between(level);
    return (1 - b.part) * r_.log_exposure[b.k] + b.part * r_.log_exposure[b.k + 1];
  }

  /// The level at which the curve, where it rises, has a value.
  double inverse(double g) const {
    const auto above = std::upper_bound(rising_.data() + 1, rising_.data() + rising_.size() - 1, g);
    const Index k = above - rising_.data() - 1;
    const double step = rising_[k + 1] - rising_[k];
    const double part = step > 0 ? (g - rising_[k]) / step : 0.5;
    return r_.black_level_dn + std::exp(u_[k] + std::clamp(part, -1.0, 2.0) * (u_[k + 1] - u_[k]));
  }

  double log_time(const PlaceLevel& p) const { return std::log(series_.exposures_s[p.exposure]); }

  /// g(level) - ln E = y within sigma.
  struct Row {
    Between at;
    double y = 0, sigma = 1;
  };
  using Rows = std::vector<std::vector<Row>>;  // of each place

  /// Eq (3).
  Rows first_rows() const {
    Rows all;
    for (const FlatPlace& place : series_.places) {
      all.emplace_back();
      for (const PlaceLevel& p : place.levels)
        all.back().push_back({between(p.level_dn), log_time(p), start_sigma / hat(p.level_dn)});
    }
    return all;
  }

  /// What an image should show of a place, and what it shows.
  struct Shown {
    double expected_dn = 0;  // z = f(E t)
    double difference = 0;   // seen minus expected, in g: g' (Z - z)
    double sigma = 1;        // of that
  };

  /// Noise in the light is bent by the curve: the mean level is off by -(g'' + g'^2) / (2 g') of
  /// its variance; of g'' what power laws have.
  Shown shown(const PlaceLevel& p, double log_light) const {
    constexpr double exact = 1e-6;  // what has no noise but its digits
    const double black = r_.black_level_dn;
    const double z = std::clamp(inverse(log_light + log_time(p)), 0.5 * (p.level_dn + black),
                                std::min(2 * p.level_dn - black, r_.full_scale_dn));
    const double bent = std::max(slope(z), 0.05), signal = z - black;
    const double curved = 0.5 * bent * (bent - 1) * p.pixel_dn2 / (signal * signal);
    return {z, bent * (p.level_dn - z) / signal + curved,
            std::max(exact, bent * std::sqrt(p.variance_dn2) / signal)};
  }

  /// Least squares of levels, not of g of levels: at the expected level, whose noise is not in the
  /// coefficients of the equation.
  Rows rows() const {
    Rows all;
    for (std::size_t i = 0; i < series_.places.size(); ++i) {
      all.emplace_back();
      for (const PlaceLevel& p : series_.places[i].levels) {
        const Shown s = shown(p, log_light_[static_cast<Index>(i)]);
        all.back().push_back({between(s.expected_dn), log_time(p) - s.difference, s.sigma});
      }
    }
    return all;
  }

  /// Linear least squares with the lights eliminated, the middle level held at zero.
  void solve(const Rows& rows) {
    const Index n = u_.size(), places = static_cast<Index>(rows.size());
    data_ = MatrixXd::Zero(n, n);
    VectorXd right = VectorXd::Zero(n), weights = VectorXd::Zero(places), observed = weights;
    std::vector<std::vector<std::pair<Index, double>>> shares(rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const auto place = static_cast<Index>(i);
      for (const Row& row : rows[i]) {
        const double weight = 1 / (row.sigma * row.sigma);
        const std::array<std::pair<Index, double>, 2> parts{
            {{row.at.k, 1 - row.at.part}, {row.at.k + 1, row.at.part}}};
        for (const auto& [j, part] : parts) {
          right[j] += weight * part * row.y;
          for (const auto& [k, other] : parts) data_(j, k) += weight * part * other;
          shares[i].emplace_back(j, weight * part);
        }
        weights[place] += weight;
        observed[place] += weight * row.y;
      }
      for (const auto& [j, share] : shares[i]) {
        right[j] -= share * observed[place] / weights[place];
        for (const auto& [k, other] : shares[i]) data_(j, k) -= share * other / weights[place];
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
    set_curve(normal.ldlt().solve(right));
  }

  void state_covariance() {
    const VectorXd g = r_.log_exposure, light = log_light_;
    solve(rows());
    set_curve(g);
    log_light_ = light;
    const Index n = u_.size();
    MatrixXd normal = data_ + prior_;
    VectorXd none = VectorXd::Zero(n);
    hold_middle(normal, none);
    covariance_ = normal.ldlt().solve(MatrixXd::Identity(n, n));
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

  void state_residuals() {
    r_.chi2 = 0;
    double count = 0;
    for (std::size_t i = 0; i < series_.places.size(); ++i) {
      const FlatPlace& place = series_.places[i];
      const double log_light = log_light_[static_cast<Index>(i)];
      for (const PlaceLevel& p : place.levels) {
        const Shown s = shown(p, log_light);
        r_.chi2 += std::pow(s.difference / s.sigma, 2);
        r_.residuals.push_back({p.exposure,
                                {place.x, place.y},
                                p.level_dn,
                                log_light + log_time(p),
                                s.difference,
                                s.sigma});
      }
      count += static_cast<double>(place.levels.size()) - 1;
    }
    r_.dof = static_cast<int>(std::lround(count - determined_));
    r_.variance_factor = variance_factor(r_.chi2, r_.dof);
    r_.covariance = r_.variance_factor * covariance_;
  }

  const SeriesPlaces& series_;
  ChannelResponse& r_;
  VectorXd u_;
  Index middle_ = 0;
  MatrixXd prior_, data_, covariance_;
  VectorXd log_light_, rising_;  // rising_: the curve without what falls
  double determined_ = 0;        // parameters that the data, not the prior, determine
};

}  // namespace

VectorXd curve_levels(const LevelRange& range) {
  constexpr int most = 256;
  const double first = std::floor(range.black_dn) + 1;
  const int levels = static_cast<int>(range.full_scale_dn - first) + 1;
  std::vector<double> chosen;
  for (int k = 0; k < std::min(levels, most); ++k) {
    // Every level of 8 bits; of deeper ones at least one apart, then as the square of k.
    const double square = (levels - 1) * std::pow(k / (most - 1.0), 2);
    chosen.push_back(first + (levels <= most ? k : std::round(std::max<double>(k, square))));
  }
  return Eigen::Map<const VectorXd>(chosen.data(), static_cast<Index>(chosen.size()));
}

bool fit_levels(const SeriesPlaces& series, double smoothness, ChannelResponse& response) {
  return LevelFit(series, response).run(smoothness);
}

}  // namespace occ::internal::photometry
