// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/pixel_noise.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"

namespace occ::internal::refine {
namespace {

/// Clipping is neglected if the end of the range is farther than this many sigmas.
constexpr double near_sigma = 4;

/// Above this noise [grey levels], rounding is independent noise to 1e-4.
constexpr double dithered_dn = 0.7;

/// Lower limit of the variance, for pixels without noise.
constexpr double min_variance_dn2 = 0.01;

constexpr int quantisation_steps = 256;
constexpr int rounding_steps =
    16;  // steps for each grey level; linear interpolation then errs by 0.002 grey levels

double density(double z) { return std::exp(-0.5 * z * z) * 0.3989422804014327; }

/// Moments of a rounded normal variable from the first terms of their Fourier series in the mean m,
/// with v the variance: E = m + s1, Var = v + 2 v s1' + 1/12 + s2 - s1^2.
PixelMoments moments_of_rounded(double mean_dn, double variance_dn2) {
  const double v = std::max(variance_dn2, min_variance_dn2);
  const double damping = std::exp(-2 * pi * pi * v);
  const double sine = std::sin(2 * pi * mean_dn), cosine = std::cos(2 * pi * mean_dn);
  double shift = 0, d_shift = 0, square = 1.0 / 12;
  double sine_k = sine, cosine_k = cosine, damped = -damping;  // (-1)^k exp(-2 pi^2 k^2 v)
  for (int k = 1; k <= 4; ++k) {
    shift += damped / (pi * k) * sine_k;
    d_shift += 2 * damped * cosine_k;
    square += damped / (pi * pi * k * k) * cosine_k;
    const double sine_next = sine_k * cosine + cosine_k * sine;
    cosine_k = cosine_k * cosine - sine_k * sine;
    sine_k = sine_next;
    damped *= -std::pow(damping, 2 * k + 1);
  }
  const double variance = v + 2 * v * d_shift + square - shift * shift;
  return {mean_dn + shift, 1 + d_shift, std::max(variance, min_variance_dn2), true};
}

}  // namespace

PixelNoise::PixelNoise(const Sensor& sensor)
    : read_variance_(sensor.read_noise_e * sensor.read_noise_e),
      gain_(sensor.gain_dn_per_e),
      black_dn_(sensor.black_level_dn),
      dark_e_(sensor.electrons(0)) {
  low_e_ = sensor.linear_dn(0) / gain_;
  const double white_e = sensor.linear_dn(sensor.full_scale_dn()) / gain_;
  full_well_first_ = sensor.full_well_e < white_e;
  high_e_ = std::min(sensor.full_well_e, white_e);
  const double step_e = 1 / gain_;
  rounding_variance_ = step_e * step_e / 12;
  if (!sensor.is_linear()) {
    for (int i = 0; i <= quantisation_steps; ++i) {
      const double stored = sensor.grey_level(high_e_ * i / quantisation_steps);
      const double above = std::min(stored + 0.5, sensor.full_scale_dn());
      const double slope = (sensor.linear_dn(above) - sensor.linear_dn(above - 1)) / gain_;
      quantisation_.push_back(slope * slope / 12);
    }
  }
  const double dithered = dithered_dn * step_e;
  const double from_low = low_e_ + near_sigma * std::sqrt(read_variance_ + std::max(0.0, low_e_));
  const double dithered_from_e = dithered * dithered - read_variance_;
  if (quantisation_.empty() && dithered_from_e > low_e_) tabulate_rounding(dithered_from_e);
  plain_from_e_ = std::max(from_low, dithered_from_e);
  plain_until_e_ = high_e_ - near_sigma * std::sqrt(read_variance_ + std::max(0.0, high_e_));
}

double PixelNoise::rounding_variance(double mean_e) const {
  if (quantisation_.empty()) return rounding_variance_;
  const double at = std::clamp(mean_e / high_e_, 0.0, 1.0) * quantisation_steps;
  return quantisation_[static_cast<std::size_t>(at + 0.5)];
}

void PixelNoise::tabulate_rounding(double until_e) {
  const double step_e = 1 / (gain_ * rounding_steps);
  for (double e = low_e_; e < std::min(until_e, high_e_) + step_e; e += step_e) {
    const double variance = read_variance_ + std::max(e, 0.0);
    PixelMoments moments = moments_of_rounded(black_dn_ + gain_ * e, gain_ * gain_ * variance);
    moments.mean = (moments.mean - black_dn_) / gain_;
    moments.variance /= gain_ * gain_;
    rounded_.push_back(moments);
  }
}

PixelMoments PixelNoise::rounded(double steps) const {
  const auto i = static_cast<std::size_t>(steps);
  const double t = steps - static_cast<double>(i);
  const PixelMoments &a = rounded_[i], &b = rounded_[i + 1];
  return {a.mean + t * (b.mean - a.mean), a.slope + t * (b.slope - a.slope),
          a.variance + t * (b.variance - a.variance), true};
}

PixelMoments PixelNoise::carefully(double mean_e, double shot) const {
  const double variance = read_variance_ + shot;
  PixelMoments moments{mean_e, 1, variance, true};
  const double deviation = std::sqrt(full_well_first_ ? shot : variance);
  if (mean_e > high_e_ + near_sigma * deviation) {
    moments.informative = false;
    return moments;
  }
  const double steps = (mean_e - low_e_) * gain_ * rounding_steps;
  if (steps >= 0 && steps < static_cast<double>(rounded_.size()) - 1) {
    moments = rounded(steps);
  } else {
    moments.variance += rounding_variance(mean_e);
  }
  clip(deviation, moments);
  return moments;
}

/// Moments of min(x, high) or max(x, low) for normal x, at the nearer end. The variance decreases
/// to that of rounding at least.
void PixelNoise::clip(double deviation, PixelMoments& moments) const {
  const bool below = moments.mean < 0.5 * (low_e_ + high_e_);
  const double sign = below ? -1 : 1;
  const double room = sign * ((below ? low_e_ : high_e_) - moments.mean);
  if (room > near_sigma * deviation || !(deviation > 0)) return;
  const double z = room / deviation;
  const double inside = normal_probability(z), outside = 1 - inside, edge = density(z);
  const double mean = z * outside - edge;
  const double square = inside - z * edge + z * z * outside;
  moments.mean += sign * deviation * mean;
  moments.slope *= inside;
  const double lost = deviation * deviation * (1 - std::max(0.0, square - mean * mean));
  moments.variance = std::max(moments.variance - lost, rounding_variance_);
}

}  // namespace occ::internal::refine
