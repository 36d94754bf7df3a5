// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "libocc/core/internal/multiversion.hpp"
#include "libocc/core/random.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/simulate/internal/pixel_noise.hpp"

namespace occ::internal::simulate {
namespace {

constexpr int numbers = 1 << 16;          // values of 16 random bits
constexpr std::size_t max_levels = 4096;  // with more, most numbers need refinement
constexpr std::size_t max_compared = 40;  // with more, a table lookup is faster

// Distribution of a pixel's electrons: Poisson, clipped at the full well, plus read noise.
class PixelDistribution {
 public:
  PixelDistribution(const Sensor& sensor, double mean_e)
      : mean_(mean_e), full_well_(sensor.full_well_e), read_noise_(sensor.read_noise_e) {
    const double spread = 10 * std::sqrt(mean_) + 20;  // Poisson mass beyond: below 1e-17
    first_ = std::max(0.0, std::floor(mean_ - spread));
    for (double n = first_; n <= mean_ + spread; ++n)
      weights_.push_back(mean_ > 0 ? std::exp(n * std::log(mean_) - mean_ - std::lgamma(n + 1))
                                   : (n == 0 ? 1.0 : 0.0));
  }

  double below(double electrons) const {
    double probability = 0;
    for (std::size_t i = 0; i < weights_.size(); ++i) {
      const double count = std::min(first_ + static_cast<double>(i), full_well_);
      const double above = electrons - count;
      probability += weights_[i] * (read_noise_ > 0 ? normal_probability(above / read_noise_)
                                                    : (above > 0 ? 1.0 : 0.0));
    }
    return std::min(probability, 1.0);
  }

 private:
  double mean_, full_well_, read_noise_, first_ = 0;
  std::vector<double> weights_;
};

struct Steps {
  const std::uint16_t* at;
  int count;
};

// Vector of pixels that are compared together.
template <Simd>
struct Batch {
  typedef std::uint16_t Vector __attribute__((vector_size(16)));
};
template <>
struct Batch<Simd::avx2> {
  typedef std::uint16_t Vector __attribute__((vector_size(32)));
};
template <>
struct Batch<Simd::avx512> {
  typedef std::uint16_t Vector __attribute__((vector_size(64)));
};
static_assert(sizeof(Batch<Simd::avx512>::Vector) == 2 * DarkNoise::padding);

// Computes levels by comparison. `inexact` receives the first pixel of each batch in which some
// numbers need refinement.
template <Simd simd>
LIBOCC_INLINE void compare_body(Steps steps, int first_level, const std::uint16_t* numbers,
                                int count, std::uint16_t* levels, int* inexact,
                                int* inexact_count) {
  using Vector = typename Batch<simd>::Vector;
  constexpr int batch = sizeof(Vector) / sizeof *numbers;
  for (int i = 0; i < count; i += batch) {
    Vector number, above = Vector{} + static_cast<std::uint16_t>(first_level), equal{};
    std::memcpy(&number, numbers + i, sizeof number);
    for (int k = 0; k < steps.count; ++k) {
      const Vector step = Vector{} + steps.at[k];
      above -= static_cast<Vector>(number > step);  // true counts as -1
      equal |= static_cast<Vector>(number == step);
    }
    std::memcpy(levels + i, &above, sizeof above);
    std::uint64_t parts[sizeof(Vector) / 8], any = 0;
    std::memcpy(parts, &equal, sizeof equal);
    for (const std::uint64_t part : parts) any |= part;
    if (any != 0) inexact[(*inexact_count)++] = i;
  }
}
LIBOCC_MULTIVERSION(compare,
                    (Steps steps, int first_level, const std::uint16_t* numbers, int count,
                     std::uint16_t* levels, int* inexact, int* inexact_count),
                    (steps, first_level, numbers, count, levels, inexact, inexact_count))

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__,
              "the low half of a word must come first in memory");

}  // namespace

DarkNoise::DarkNoise(const Sensor& sensor, const Digitiser& digitiser, double mean_e) {
  // With more electrons, building the table costs more than it saves.
  if (!(mean_e < 1000)) return;
  const double deviation = std::sqrt(mean_e + sensor.read_noise_e * sensor.read_noise_e);
  first_level_ = digitiser.grey_level(mean_e - 9 * deviation - 1);
  const int last = digitiser.grey_level(mean_e + 9 * deviation + 30);
  if (last - first_level_ > static_cast<int>(max_levels)) return;
  const PixelDistribution distribution(sensor, mean_e);
  for (int level = first_level_; level < last; ++level)
    cumulative_.push_back(distribution.below(digitiser.upper_bound_e(level)));
  for (const double probability : cumulative_)
    if (probability * numbers < numbers)
      steps_.push_back(static_cast<std::uint16_t>(probability * numbers));
  cumulative_.push_back(1);
  if (steps_.size() <= max_compared) return;
  levels_.resize(numbers);
  for (std::size_t number = 0; number < levels_.size(); ++number)
    levels_[number] = static_cast<std::uint16_t>(
        first_level_ + (std::lower_bound(steps_.begin(), steps_.end(), number) - steps_.begin()));
}

int DarkNoise::refined(const NoiseKey& key, std::uint32_t pixel, std::uint32_t number) const {
  const auto bits = philox({pixel, refine_use, 0, key.frame}, key.words());
  const double more = (bits[0] + 0x1p-32 * bits[1]) * 0x1p-32;
  const double uniform = (number + more) / numbers;
  const auto level = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, uniform);
  return first_level_ + static_cast<int>(level - cumulative_.begin());
}

void DarkNoise::draw(Simd simd, const NoiseKey& key, RandomWords random, std::uint32_t first,
                     int count, std::uint16_t* levels) const {
  for (; count > 0; first += max_batch, levels += max_batch, count -= max_batch) {
    draw_batch(simd, key, random, first, std::min(count, max_batch), levels);
    random.words += max_batch / 2;
  }
}

void DarkNoise::draw_batch(Simd simd, const NoiseKey& key, const RandomWords& random,
                           std::uint32_t first, int count, std::uint16_t* levels) const {
  std::array<std::uint16_t, pixels_per_block + max_batch + padding>
      halves;  // low half of each word first
  const std::size_t used = random.skip + static_cast<std::size_t>(count) + padding;
  std::memcpy(halves.data(), random.words, used * sizeof(std::uint16_t));
  const std::uint16_t* number = halves.data() + random.skip;
  const auto refine = [&](int begin, int end) {
    for (int i = begin; i < end; ++i)
      if (std::binary_search(steps_.begin(), steps_.end(), number[i]))
        levels[i] = static_cast<std::uint16_t>(
            refined(key, first + static_cast<std::uint32_t>(i), number[i]));
  };
  if (!levels_.empty()) {
    for (int i = 0; i < count; ++i) levels[i] = levels_[number[i]];
    return refine(0, count);
  }
  std::array<int, max_batch / 8 + 1> inexact;
  int inexact_count = 0;
  compare_for(simd)({steps_.data(), static_cast<int>(steps_.size())}, first_level_, number, count,
                    levels, inexact.data(), &inexact_count);
  for (int i = 0; i < inexact_count; ++i) {
    const int begin = inexact[i];
    refine(begin, std::min(begin + padding, count));
  }
}

}  // namespace occ::internal::simulate
