// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/random.hpp"

#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ {

namespace {

/// High and low half of a * b.
std::array<std::uint32_t, 2> multiply(std::uint32_t a, std::uint32_t b) {
  const std::uint64_t product = static_cast<std::uint64_t>(a) * b;
  return {static_cast<std::uint32_t>(product >> 32), static_cast<std::uint32_t>(product)};
}

/// ln k!, to 1e-12: a table, then Stirling's series.
double log_factorial(double k) {
  static constexpr std::array<double, 10> factorial{1, 1, 2, 6, 24, 120, 720, 5040, 40320, 362880};
  if (k < 10) return std::log(factorial[static_cast<std::size_t>(k)]);
  const double inverse = 1 / k, squared = inverse * inverse;
  const double series =
      inverse *
      (1.0 / 12 - squared * (1.0 / 360 - squared * (1.0 / 1260 - squared * (1.0 / 1680))));
  return (k + 0.5) * std::log(k) - k + 0.5 * std::log(2 * pi) + series;
}

/// Sequential search of the cumulative distribution; its cost grows with the mean.
int poisson_by_inversion(Random& random, double mean) {
  double remaining = random.uniform(), probability = std::exp(-mean);
  int count = 0;
  while (remaining >= probability && probability > 0) {
    remaining -= probability;
    ++count;
    probability *= mean / count;
  }
  return count;
}

/// Algorithm PTRS of W. Hoermann, "The transformed rejection method for generating Poisson random
/// variables", Insurance: Mathematics and Economics 12 (1993), for a mean of at least 10.
int poisson_by_rejection(Random& random, double mean) {
  const double b = 0.931 + 2.53 * std::sqrt(mean);
  const double a = -0.059 + 0.02483 * b;
  const double inverse_alpha = 1.1239 + 1.1328 / (b - 3.4);
  const double v_accept = 0.9277 - 3.6224 / (b - 2);
  const double log_mean = std::log(mean);
  while (true) {
    const double u = random.uniform() - 0.5, v = random.uniform();
    const double us = 0.5 - std::abs(u);
    const double k = std::floor((2 * a / us + b) * u + mean + 0.43);
    if (us >= 0.07 && v <= v_accept) return static_cast<int>(k);
    if (!(k >= 0) || (us < 0.013 && v > us)) continue;
    if (std::log(v * inverse_alpha / (a / (us * us) + b)) <=
        k * log_mean - mean - log_factorial(k)) {
      return static_cast<int>(k);
    }
  }
}

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                    std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const auto [high0, low0] = multiply(0xD2511F53u, counter[0]);
    const auto [high1, low1] = multiply(0xCD9E8D57u, counter[2]);
    counter = {high1 ^ counter[1] ^ key[0], low1, high0 ^ counter[3] ^ key[1], low0};
    key = {key[0] + 0x9E3779B9u, key[1] + 0xBB67AE85u};
  }
  return counter;
}

Random::Random(std::uint64_t seed, std::uint64_t stream) {
  key_ = {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)};
  counter_ = {0, 0, static_cast<std::uint32_t>(stream), static_cast<std::uint32_t>(stream >> 32)};
}

std::uint32_t Random::bits() {
  if (used_ == 4) {
    block_ = philox(counter_, key_);
    if (++counter_[0] == 0) ++counter_[1];
    used_ = 0;
  }
  return block_[used_++];
}

double Random::uniform() {
  const std::uint64_t high = bits();
  const std::uint64_t low = bits();
  return static_cast<double>((high << 21) ^ (low >> 11)) * 0x1p-53;
}

double Random::uniform(double low, double high) {
  const double value = low + (high - low) * uniform();
  return value < high ? value : std::nextafter(high, low);  // the sum may round up to `high`
}

double Random::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_normal_;
  }
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  const double angle = 2 * pi * uniform();
  spare_normal_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

int Random::poisson(double mean) {
  require(mean >= 0 && mean <= 2e9, "mean", mean, "between 0 and 2e9");
  return mean < 10 ? poisson_by_inversion(*this, mean) : poisson_by_rejection(*this, mean);
}

int Random::below(int count) {
  require(count > 0, "count", count, "positive");
  // Lemire, "Fast random integer generation in an interval", 2019: unbiased by rejecting the few
  // products whose low half falls below 2^32 mod count.
  const auto range = static_cast<std::uint32_t>(count);
  const std::uint32_t reject_below = (0u - range) % range;
  while (true) {
    const auto [high, low] = multiply(bits(), range);
    if (low >= reject_below) return static_cast<int>(high);
  }
}

}  // namespace occ
