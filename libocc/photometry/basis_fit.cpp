// SPDX-License-Identifier: Apache-2.0
// Least squares fit of a response curve from a basis (ResponseMethod::basis). The light of each
// patch is eliminated:
//     Z_ij = black + R (f_0(x) + sum_k c_k h_k(x)),   x = E_i t_j / scale,   R = full scale -
//     black.
// Gauss-Newton steps over the coefficients c and ln E_i; steps that increase chi2 are halved.
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/photometry/internal/response_fit.hpp"
#include "libocc/radiometry/response_basis.hpp"

namespace occ::internal::photometry {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int samples =
    16384;  // of the curve; a power law of 1/3 rises to 0.04 in the first interval
constexpr int max_basis_steps = 60;

class BasisFit {
 public:
  BasisFit(const PatchSeries& series, int functions, ChannelResponse& response)
      : series_(series),
        r_(response),
        range_dn_(response.full_scale_dn - response.black_level_dn),
        basis_(response_basis(functions, samples)),
        c_(VectorXd::Zero(functions)),
        log_light_(static_cast<Index>(series.patches.size())) {
    curve_ = basis_.mean;
    for (Index i = 0; i < log_light_.size(); ++i) start_light(i);
  }

  bool run() {
    double chi2 = linearise();
    for (int step = 0; step < max_basis_steps; ++step) {
      const VectorXd d_c = core::solve_ldlt(normal_, right_);
      const VectorXd d_light = light_right_.cwiseQuotient(light_normal_) - light_of_c_ * d_c;
      const VectorXd c = c_, light = log_light_;
      double step_fraction = 1, next = 0;
      for (;; step_fraction /= 2) {
        c_ = c + step_fraction * d_c;
        log_light_ = light + step_fraction * d_light;
        curve_ = basis_.mean + basis_.functions * c_;
        next = linearise();
        if (next <= chi2 * (1 + 1e-12)) break;
        if (step_fraction < 1e-4) return false;
      }
      const bool converged = step_fraction * d_c.cwiseAbs().maxCoeff() < 1e-7;
      chi2 = next;
      if (converged) return finish(chi2);
    }
    return false;
  }

 private:
  /// Position x between samples i and i + 1.
  struct Sample {
    Index i = 0;
    double fraction = 0;
  };
  Sample at(double x) const {
    const double position = std::clamp(x, 0.0, 1.5) * (samples - 1);
    const Index i = std::min(static_cast<Index>(position), static_cast<Index>(samples) - 2);
    return {i, position - static_cast<double>(i)};  // above 1: linear extrapolation
  }
  template <typename Values>
  static double between(const Values& values, const Sample& a) {
    return values[a.i] + a.fraction * (values[a.i + 1] - values[a.i]);
  }
  /// x at which the rising curve has this value.
  double inverse(double value) const {
    const auto above = std::lower_bound(curve_.data() + 1, curve_.data() + samples - 1, value);
    const Index i = above - curve_.data() - 1;
    const double fraction = (value - curve_[i]) / (curve_[i + 1] - curve_[i]);
    return (static_cast<double>(i) + fraction) / (samples - 1);
  }
  double log_time(const PatchLevel& p) const { return std::log(series_.exposures_s[p.exposure]); }

  void start_light(Index i) {
    const FlatPatch& patch = series_.patches[i];
    double sum = 0;
    for (const PatchLevel& p : patch.levels)
      sum += std::log(std::max(inverse((p.level_dn - r_.black_level_dn) / range_dn_), 1e-6)) -
             log_time(p);
    log_light_[i] = sum / static_cast<double>(patch.levels.size());
  }

  /// Normal equations of the coefficients with the lights eliminated; returns chi2.
  double linearise() {
    const Index n = c_.size(), m = log_light_.size();
    normal_ = MatrixXd::Zero(n, n);
    right_ = VectorXd::Zero(n);
    light_of_c_ = MatrixXd::Zero(m, n);
    light_right_ = light_normal_ = VectorXd::Zero(m);
    residuals_.clear();
    double chi2 = 0;
    for (Index i = 0; i < m; ++i) {
      const FlatPatch& patch = series_.patches[i];
      for (const PatchLevel& p : patch.levels) chi2 += add(p, patch, i);
      light_of_c_.row(i) /= light_normal_[i];
      normal_ -= light_normal_[i] * light_of_c_.row(i).transpose() * light_of_c_.row(i);
      right_ -= light_of_c_.row(i).transpose() * light_right_[i];
    }
    return chi2;
  }

  double add(const PatchLevel& p, const FlatPatch& patch, Index i) {
    const double log_x = log_light_[i] + log_time(p), x = std::exp(log_x);
    const Sample a = at(x);
    const double slope = (curve_[a.i + 1] - curve_[a.i]) * (samples - 1);
    const double weight = 1 / p.variance_dn2;
    const double residual = p.level_dn - r_.black_level_dn - range_dn_ * between(curve_, a);
    const double d_light = range_dn_ * slope * x;
    VectorXd d_c(c_.size());
    for (Index k = 0; k < c_.size(); ++k) d_c[k] = range_dn_ * between(basis_.functions.col(k), a);
    normal_ += weight * d_c * d_c.transpose();
    right_ += weight * residual * d_c;
    light_of_c_.row(i) += weight * d_light * d_c.transpose();
    light_right_[i] += weight * d_light * residual;
    light_normal_[i] += weight * d_light * d_light;
    residuals_.push_back({p.exposure,
                          {patch.x, patch.y},
                          p.level_dn,
                          log_x,
                          residual / d_light,
                          std::sqrt(p.variance_dn2) / d_light});
    return weight * residual * residual;
  }

  bool finish(double chi2) {
    if (!make_rising()) return false;
    const core::Ldlt<MatrixXd> ldlt(normal_);
    const VectorXd d = ldlt.factors().vectorD();
    if (!(d.minCoeff() > 1e-12 * d.maxCoeff())) return false;
    r_.chi2 = chi2;
    r_.dof = static_cast<int>(residuals_.size()) - static_cast<int>(log_light_.size() + c_.size());
    r_.variance_factor = variance_factor(chi2, r_.dof);
    r_.coefficients.assign(c_.data(), c_.data() + c_.size());
    r_.coefficient_covariance =
        r_.variance_factor * ldlt.solve<MatrixXd>(MatrixXd::Identity(c_.size(), c_.size()));
    write_curve();
    return true;
  }

  /// False if the curve decreases between observed levels; elsewhere it is made rising.
  bool make_rising() {
    for (Index i = 1; i < samples; ++i) {
      if (curve_[i] > curve_[i - 1]) continue;
      const double level = r_.black_level_dn + range_dn_ * curve_[i];
      if (level >= r_.lowest_dn && level <= r_.highest_dn) return false;
      curve_[i] = curve_[i - 1] + 1e-9;
      r_.projected = 1;
    }
    return true;
  }

  /// g = ln f^-1 at the levels, zero at the middle one: dg/dc_k = -h_k / (x f').
  void write_curve() {
    const Index n = r_.level_dn.size();
    r_.log_exposure.resize(n);
    MatrixXd d_c(n, c_.size());
    for (Index k = 0; k < n; ++k) {
      const double x = inverse((r_.level_dn[k] - r_.black_level_dn) / range_dn_);
      const Sample a = at(x);
      const double slope = (curve_[a.i + 1] - curve_[a.i]) * (samples - 1);
      r_.log_exposure[k] = std::log(x);
      for (Index j = 0; j < c_.size(); ++j)
        d_c(k, j) = -between(basis_.functions.col(j), a) / (x * slope);
    }
    Index middle = 0;
    const double middle_dn = 0.5 * (r_.black_level_dn + r_.full_scale_dn);
    while (middle + 2 < n && r_.level_dn[middle + 1] <= middle_dn) ++middle;
    const double zero = r_.log_exposure[middle];
    r_.log_exposure.array() -= zero;
    for (ResponseResidual& row : residuals_) row.log_exposure -= zero;
    const Eigen::RowVectorXd at_middle = d_c.row(middle);
    d_c.rowwise() -= at_middle;
    r_.covariance = core::product_transposed(core::product(d_c, r_.coefficient_covariance), d_c);
    r_.residuals = residuals_;
  }

  const PatchSeries& series_;
  ChannelResponse& r_;
  double range_dn_;
  ResponseBasis basis_;
  VectorXd c_, log_light_, curve_;
  MatrixXd normal_, light_of_c_;
  VectorXd right_, light_right_, light_normal_;
  std::vector<ResponseResidual> residuals_;
};

}  // namespace

bool fit_basis(const PatchSeries& series, int functions, ChannelResponse& response) {
  return BasisFit(series, functions, response).run();
}

}  // namespace occ::internal::photometry
