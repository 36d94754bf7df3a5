// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/sensor_noise.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/random.hpp"

namespace occ {
namespace {

constexpr std::uint16_t needs_refining = 0xffff;
constexpr int numbers = 1 << 16;

// Second word of the Philox counter: which use of randomness. `Random` counts its blocks in the
// first two words and stays at 0 here.
enum Use : std::uint32_t { dark_use = 1, refine_use = 2 };

// Below this the exact Poisson sampler is used; above it a normal variable differs from it by a
// skewness of less than 1e-4.
constexpr double max_poisson_mean = 1e8;

double draw_electrons(Random& random, double mean, double full_well) {
  const double deviation = std::sqrt(mean);
  if (mean - full_well > 50 + 12 * deviation) return full_well;  // certain to within 1e-30
  const double count = mean < max_poisson_mean ? random.poisson(mean)
                                               : std::round(mean + deviation * random.normal());
  return std::min(count, full_well);
}

double normal_probability(double z) { return 0.5 * std::erfc(-z * std::sqrt(0.5)); }

}  // namespace

SensorNoise::SensorNoise(const Sensor& sensor, const Digitiser& digitiser, std::uint64_t seed,
                         std::uint32_t frame)
    : digitiser_(digitiser),
      full_well_e_(sensor.full_well_e),
      read_noise_e_(sensor.read_noise_e),
      dark_e_(sensor.electrons(0)),
      seed_(seed),
      frame_(frame) {
  // With more dark current than this, building the table costs more than it saves.
  if (dark_e_ < 1000) tabulate_dark();
}

int SensorNoise::lit(std::uint32_t pixel, double mean_e) const {
  Random random(seed_, (static_cast<std::uint64_t>(frame_) << 32) | pixel);
  double electrons = draw_electrons(random, mean_e, full_well_e_);
  if (read_noise_e_ > 0) electrons += read_noise_e_ * random.normal();
  return digitiser_.grey_level(electrons);
}

// Probability that a dark pixel's clipped electrons and read noise together stay below `electrons`.
double SensorNoise::probability_below(double electrons) const {
  const double spread = 10 * std::sqrt(dark_e_) + 20;  // Poisson mass beyond: below 1e-17
  const double first = std::max(0.0, std::floor(dark_e_ - spread));
  double probability = 0;
  for (double n = first; n <= dark_e_ + spread; ++n) {
    const double weight = dark_e_ > 0
                              ? std::exp(n * std::log(dark_e_) - dark_e_ - std::lgamma(n + 1))
                              : (n == 0 ? 1.0 : 0.0);
    const double above = electrons - std::min(n, full_well_e_);
    const double below =
        read_noise_e_ > 0 ? normal_probability(above / read_noise_e_) : (above > 0 ? 1.0 : 0.0);
    probability += weight * below;
  }
  return std::min(probability, 1.0);
}

void SensorNoise::tabulate_dark() {
  const double deviation = std::sqrt(dark_e_ + read_noise_e_ * read_noise_e_);
  first_level_ = digitiser_.grey_level(dark_e_ - 9 * deviation - 1);
  const int last = digitiser_.grey_level(dark_e_ + 9 * deviation + 30);
  if (last - first_level_ > 4096) return;  // so many levels that most numbers need refining
  for (int level = first_level_; level < last; ++level)
    cumulative_.push_back(probability_below(digitiser_.upper_bound_e(level)));
  cumulative_.push_back(1);

  dark_table_.assign(numbers, needs_refining);
  double below = 0;
  for (std::size_t i = 0; i < cumulative_.size(); ++i) {
    // Numbers whose whole cell [number, number + 1) / 65536 belongs to this level.
    const double begin = std::ceil(below * numbers), end = std::floor(cumulative_[i] * numbers);
    for (double number = begin; number < end; ++number)
      dark_table_[static_cast<std::size_t>(number)] = static_cast<std::uint16_t>(i);
    below = cumulative_[i];
  }
}

int SensorNoise::refine(std::uint32_t pixel, std::uint32_t number) const {
  const auto bits =
      philox({pixel, refine_use, 0, frame_},
             {static_cast<std::uint32_t>(seed_), static_cast<std::uint32_t>(seed_ >> 32)});
  const double more = (bits[0] + 0x1p-32 * bits[1]) * 0x1p-32;
  const double uniform = (number + more) / numbers;
  const auto level = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, uniform);
  return static_cast<int>(level - cumulative_.begin());
}

std::array<int, SensorNoise::dark_block> SensorNoise::dark(std::uint32_t block) const {
  std::array<int, dark_block> levels;
  const std::uint32_t first_pixel = block * dark_block;
  if (dark_table_.empty()) {
    for (std::uint32_t i = 0; i < dark_block; ++i) levels[i] = lit(first_pixel + i, dark_e_);
    return levels;
  }
  const auto bits = philox({block, dark_use, 0, frame_}, {static_cast<std::uint32_t>(seed_),
                                                          static_cast<std::uint32_t>(seed_ >> 32)});
  for (std::uint32_t i = 0; i < dark_block; ++i) {
    const std::uint32_t number = i % 2 == 0 ? bits[i / 2] & 0xffff : bits[i / 2] >> 16;
    const std::uint16_t entry = dark_table_[number];
    levels[i] = first_level_ + (entry == needs_refining ? refine(first_pixel + i, number) : entry);
  }
  return levels;
}

}  // namespace occ
