// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/moment_filter.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"

namespace occ {
namespace {

constexpr Eigen::Index samples = 512;

// Beyond this sigma the filter is a constant times a derivative, to 1e-6, and a new fit would be
// less accurate.
constexpr double max_fitted_sigma_px = 4;

double variance(double sigma_px) { return sigma_px * sigma_px + 1.0 / 12; }

}  // namespace

MomentFilter::MomentFilter(double psf_sigma_px) {
  const double sigma = std::min(psf_sigma_px, max_fitted_sigma_px);
  Eigen::MatrixXd responses(samples, 4);
  Eigen::VectorXd wanted(samples);
  for (Eigen::Index i = 0; i < samples; ++i) {
    const double k = pi * (static_cast<double>(i) + 0.5) / static_cast<double>(samples);
    const double spectrum = std::exp(-0.5 * sigma * sigma * k * k) * std::sin(0.5 * k) / (0.5 * k);
    const double weight = spectrum / k;
    wanted[i] = weight * (sigma * sigma * k + 1 / k - 0.5 / std::tan(0.5 * k));
    for (Eigen::Index j = 0; j < 4; ++j)
      responses(i, j) = weight * 2 * std::sin(static_cast<double>(j + 1) * k);
  }
  const Eigen::Vector4d taps = internal::core::OrthogonalFactors(responses).solve(wanted);
  for (std::size_t j = 0; j < 4; ++j)
    taps_[j] = taps[static_cast<Eigen::Index>(j)] * variance(psf_sigma_px) / variance(sigma);
}

}  // namespace occ
