// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/pixel_noise.hpp"

#include <algorithm>
#include <cmath>

namespace occ {
namespace {

constexpr double pi = 3.14159265358979323846;

/// Ends of the range further away than this many sigmas do not matter.
constexpr double near_sigma = 4;

/// Noise [grey levels] from which on rounding is independent noise to 1e-4.
constexpr double dithered_dn = 0.7;

constexpr int quantisation_steps = 256;

double density(double z) { return std::exp(-0.5 * z * z) * 0.3989422804014327; }
double cumulative(double z) { return 0.5 * std::erfc(-z * std::sqrt(0.5)); }

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
  if (sensor.response != Response::linear) {
    for (int i = 0; i <= quantisation_steps; ++i) {
      const double stored = sensor.grey_level(high_e_ * i / quantisation_steps);
      const double above = std::min(stored + 0.5, sensor.full_scale_dn());
      const double slope = (sensor.linear_dn(above) - sensor.linear_dn(above - 1)) / gain_;
      quantisation_.push_back(slope * slope / 12);
    }
  }
  const double dithered = dithered_dn * step_e;
  const double from_low = low_e_ + near_sigma * std::sqrt(read_variance_ + std::max(0.0, low_e_));
  plain_from_e_ = std::max(from_low, dithered * dithered - read_variance_);
  plain_until_e_ = high_e_ - near_sigma * std::sqrt(read_variance_ + std::max(0.0, high_e_));
}

double PixelNoise::rounding_variance(double mean_e) const {
  if (quantisation_.empty()) return rounding_variance_;
  const double at = std::clamp(mean_e / high_e_, 0.0, 1.0) * quantisation_steps;
  return quantisation_[static_cast<std::size_t>(at + 0.5)];
}

PixelMoments PixelNoise::carefully(double mean_e, double shot) const {
  const double variance = read_variance_ + shot;
  PixelMoments moments{mean_e, 1, variance, true};
  const double deviation = std::sqrt(full_well_first_ ? shot : variance);
  if (mean_e > high_e_ + near_sigma * deviation) {
    moments.tells = false;
    return moments;
  }
  const double dithered = dithered_dn / gain_;
  if (quantisation_.empty() && variance < dithered * dithered) {
    round(moments);
  } else {
    moments.variance += rounding_variance(mean_e);
  }
  clip(deviation, moments);
  return moments;
}

/// Moments of min(x, high) or max(x, low), x normal, whichever end is near. Its variance falls, but
/// never below the rounding's.
void PixelNoise::clip(double deviation, PixelMoments& moments) const {
  const bool below = moments.mean < 0.5 * (low_e_ + high_e_);
  const double sign = below ? -1 : 1;
  if (!(deviation > 0)) return;
  const double z = sign * ((below ? low_e_ : high_e_) - moments.mean) / deviation;
  if (z > near_sigma) return;
  const double inside = cumulative(z), outside = 1 - inside, edge = density(z);
  const double mean = z * outside - edge;
  const double square = inside - z * edge + z * z * outside;
  moments.mean += sign * deviation * mean;
  moments.slope *= inside;
  const double lost = deviation * deviation * (1 - std::max(0.0, square - mean * mean));
  moments.variance = std::max(moments.variance - lost, rounding_variance_);
}

/// Moments of a rounded normal variable, by the first terms of their Fourier series in the place of
/// the mean between grey levels: E = m + s1, Var = v + 2 v s1' + 1/12 + s2 - s1^2.
void PixelNoise::round(PixelMoments& moments) const {
  const double mean_dn = black_dn_ + gain_ * moments.mean;
  const double variance = std::max(gain_ * gain_ * moments.variance, 0.01);
  double shift = 0, d_shift = 0, square = 1.0 / 12, sign = -1;
  for (int k = 1; k <= 4; ++k, sign = -sign) {
    const double damped = sign * std::exp(-2 * pi * pi * k * k * variance);
    shift += damped / (pi * k) * std::sin(2 * pi * k * mean_dn);
    d_shift += 2 * damped * std::cos(2 * pi * k * mean_dn);
    square += damped / (pi * pi * k * k) * std::cos(2 * pi * k * mean_dn);
  }
  const double rounded = variance + 2 * variance * d_shift + square - shift * shift;
  moments.mean += shift / gain_;
  moments.slope += d_shift;
  moments.variance = std::max(rounded, 0.01) / (gain_ * gain_);
}

}  // namespace occ
