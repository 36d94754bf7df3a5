// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/lit_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/random.hpp"
#include "libocc/simulate/internal/normal_variate.hpp"

namespace occ {
namespace {

constexpr double least_read_noise_e = 1;
constexpr double most_skewness = 0.1;
constexpr double certain_deviations = 7;  // from the full well: then clipped, or not, to 1e-12
constexpr std::uint32_t pixels_a_block = 4;

// Above this a normal variable differs from a Poisson one by a skewness of less than 1e-4.
constexpr double max_poisson_mean = 1e8;

struct Job {
  float full_well, read_variance;
};

LIBOCC_INLINE float drawn(const Job& job, double mean, std::uint32_t word) {
  const auto lit = static_cast<float>(mean);
  const bool full = lit > job.full_well;
  const float level = full ? job.full_well : lit;
  const float shot = full ? 0 : lit;
  const float deviation = __builtin_sqrtf(shot + job.read_variance);
  const float inverse = 1 / deviation;
  const float skewness = shot * inverse * inverse * inverse;
  const float kurtosis = skewness * inverse;
  const float z = normal_variate(word);
  const float z2 = z * z, z3 = z2 * z;
  const float shape = z + skewness * (z2 - 1) * (1.0f / 6) + kurtosis * (z3 - 3 * z) * (1.0f / 24) -
                      skewness * skewness * (2 * z3 - 5 * z) * (1.0f / 36);
  return level + deviation * shape;
}

// In whole vectors: the pixels left over at the end would take as long as all before.
template <Simd>
LIBOCC_INLINE void draw_body(Job job, const double* mean, const std::uint32_t* words, int count,
                             float* electrons) {
  for (int first = 0; first < count; first += LitNoise::batch)
    for (int i = 0; i < LitNoise::batch; ++i)
      electrons[first + i] = drawn(job, mean[first + i], words[first + i]);
}
LIBOCC_MULTIVERSION(draw,
                    (Job job, const double* mean, const std::uint32_t* words, int count,
                     float* electrons),
                    (job, mean, words, count, electrons))

}  // namespace

LitNoise::LitNoise(const Sensor& sensor)
    : full_well_e_(sensor.full_well_e), read_noise_e_(sensor.read_noise_e) {
  if (read_noise_e_ < least_read_noise_e) {
    skewed_ = {0, std::numeric_limits<double>::infinity()};
    return;
  }
  // Skewness mean / (mean + read^2)^1.5 is largest at 2 read^2 and falls off on both sides.
  const double variance = read_noise_e_ * read_noise_e_;
  const auto is_skewed = [&](double mean) {
    return mean > most_skewness * std::pow(mean + variance, 1.5);
  };
  const auto edge = [&](double inside, double outside) {
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (inside + outside);
      (is_skewed(middle) ? inside : outside) = middle;
    }
    return outside;
  };
  if (is_skewed(2 * variance))
    skewed_ = {edge(2 * variance, 0), edge(2 * variance, 1 / (most_skewness * most_skewness))};
  const double half = 0.5 * certain_deviations, root = std::sqrt(half * half + full_well_e_);
  near_full_ = {(root - half) * (root - half), (root + half) * (root + half)};
}

double LitNoise::exact(const NoiseKey& key, std::uint32_t pixel, double mean_e) const {
  Random random(key.seed, (static_cast<std::uint64_t>(key.frame) << 32) | pixel);
  const double deviation = std::sqrt(mean_e);
  double electrons = full_well_e_;
  if (!(mean_e - full_well_e_ > 50 + 12 * deviation)) {  // else clipped to within 1e-30
    const double count = mean_e < max_poisson_mean
                             ? random.poisson(mean_e)
                             : std::round(mean_e + deviation * random.normal());
    electrons = std::min(count, full_well_e_);
  }
  if (read_noise_e_ > 0) electrons += read_noise_e_ * random.normal();
  return electrons;
}

void LitNoise::draw(Simd simd, const NoiseKey& key, std::uint32_t first, int count,
                    const double* mean_e, float* electrons) const {
  using Words = PixelWords<pixels_a_block>;
  constexpr int most = Words::most;
  const Job job{static_cast<float>(full_well_e_),
                static_cast<float>(read_noise_e_ * read_noise_e_)};
  for (; count > 0; first += most, mean_e += most, electrons += most, count -= most) {
    const int part = std::min(count, most);
    const bool all_exact = read_noise_e_ < least_read_noise_e;
    if (!all_exact) {
      const Words random(simd, key, lit_use, first, static_cast<std::uint32_t>(part));
      draw_for(simd)(job, mean_e, random.words.data() + random.skip, part, electrons);
    }
    for (int i = 0; i < part; ++i) {
      const double mean = mean_e[i];
      if (skewed_.contains(mean) || near_full_.contains(mean))
        electrons[i] = static_cast<float>(exact(key, first + static_cast<std::uint32_t>(i), mean));
    }
  }
}

}  // namespace occ
