// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "libocc/core/random.hpp"
#include "libocc/simulate/internal/normal_variate.hpp"
#include "libocc/simulate/internal/pixel_noise.hpp"

namespace occ::internal::simulate {
namespace {

constexpr double min_read_noise_e = 1;  // limits of the expansion, see pixel_noise.hpp
constexpr double max_skewness = 0.1;
// Farther from the full well, a pixel is clipped, or not, with a probability of 1 - 1e-12.
constexpr double certain_deviations = 7;

// Above this mean the skewness of a Poisson variable, 1 / sqrt(mean), is below 1e-4: it is drawn as
// a normal variable.
constexpr double max_poisson_mean = 1e8;

struct Job {
  float full_well, read_variance;
  LitNoise::Range skewed, near_full;  // pixels drawn exactly
};

LIBOCC_INLINE float drawn(const Job& job, float lit, std::uint32_t word) {
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

// Works on whole vectors, because single pixels at the end would take as long as the rest.
// `inexact` receives the first pixel of each batch in which some pixels must be drawn exactly.
template <Simd>
LIBOCC_INLINE void draw_body(Job job, const float* mean, const std::uint32_t* words, int count,
                             float* __restrict electrons, int* inexact, int* inexact_count) {
  for (int first = 0; first < count; first += LitNoise::batch) {
    for (int i = first; i < first + LitNoise::batch; ++i)
      electrons[i] = drawn(job, mean[i], words[i]);
    std::int32_t any = 0;  // as wide as the means, so that both fit the same vectors
    for (int i = first; i < first + LitNoise::batch; ++i) {
      const std::int32_t skewed = (mean[i] > job.skewed.low) & (mean[i] < job.skewed.high);
      const std::int32_t full = (mean[i] > job.near_full.low) & (mean[i] < job.near_full.high);
      any |= skewed | full;
    }
    if (any != 0) inexact[(*inexact_count)++] = first;
  }
}
LIBOCC_MULTIVERSION(draw,
                    (Job job, const float* mean, const std::uint32_t* words, int count,
                     float* electrons, int* inexact, int* inexact_count),
                    (job, mean, words, count, electrons, inexact, inexact_count))

}  // namespace

LitNoise::LitNoise(const Sensor& sensor)
    : full_well_e_(sensor.full_well_e), read_noise_e_(sensor.read_noise_e) {
  if (read_noise_e_ < min_read_noise_e) {
    skewed_ = {-1, std::numeric_limits<float>::infinity()};
    return;
  }
  // Skewness mean / (mean + read^2)^1.5 is largest at 2 read^2 and falls on both sides.
  const double variance = read_noise_e_ * read_noise_e_;
  const auto is_skewed = [&](double mean) {
    return mean > max_skewness * std::pow(mean + variance, 1.5);
  };
  const auto edge = [&](double inside, double outside) {
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (inside + outside);
      (is_skewed(middle) ? inside : outside) = middle;
    }
    return static_cast<float>(outside);
  };
  if (is_skewed(2 * variance))
    skewed_ = {edge(2 * variance, 0), edge(2 * variance, 1 / (max_skewness * max_skewness))};
  const double half = 0.5 * certain_deviations, root = std::sqrt(half * half + full_well_e_);
  near_full_ = {static_cast<float>((root - half) * (root - half)),
                static_cast<float>((root + half) * (root + half))};
}

double LitNoise::exact(const NoiseKey& key, std::uint32_t pixel, double mean_e) const {
  Random random(key.seed, (static_cast<std::uint64_t>(key.frame) << 32) | pixel);
  const double deviation = std::sqrt(mean_e);
  double electrons = full_well_e_;
  if (!(mean_e - full_well_e_ >
        50 + 12 * deviation)) {  // otherwise clipped, except with probability 1e-30
    const double count = mean_e < max_poisson_mean
                             ? random.poisson(mean_e)
                             : std::round(mean_e + deviation * random.normal());
    electrons = std::min(count, full_well_e_);
  }
  if (read_noise_e_ > 0) electrons += read_noise_e_ * random.normal();
  return electrons;
}

void LitNoise::draw(Simd simd, const NoiseKey& key, const RandomWords& random, std::uint32_t first,
                    int count, const float* mean_e, float* electrons) const {
  constexpr int max_batch = 64 * batch;
  const Job job{static_cast<float>(full_well_e_), static_cast<float>(read_noise_e_ * read_noise_e_),
                skewed_, near_full_};
  const std::uint32_t* words = random.words + random.skip;
  for (; count > 0; first += max_batch, mean_e += max_batch, electrons += max_batch,
                    words += max_batch, count -= max_batch) {
    const int part = std::min(count, max_batch);
    std::array<int, max_batch / batch> inexact;
    int inexact_count = 0;
    draw_for(simd)(job, mean_e, words, part, electrons, inexact.data(), &inexact_count);
    for (int k = 0; k < inexact_count; ++k) {
      const int begin = inexact[k];
      for (int i = begin; i < std::min(begin + batch, part); ++i)
        if (skewed_.contains(mean_e[i]) || near_full_.contains(mean_e[i]))
          electrons[i] = static_cast<float>(
              exact(key, first + static_cast<std::uint32_t>(i), static_cast<double>(mean_e[i])));
    }
  }
}

}  // namespace occ::internal::simulate
