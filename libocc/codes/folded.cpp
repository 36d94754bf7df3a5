// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/internal/folded.hpp"

#include <algorithm>
#include <cmath>

namespace occ::internal::codes {
namespace {

/// Light of one channel until a time [chips]; beyond the pattern's ends its first and last chip
/// go on.
double light_until(const std::vector<double>& chips, double at) {
  if (at <= 0) return at * chips.front();
  const auto n = chips.size();
  double sum = 0;
  const auto whole = std::min(n, static_cast<std::size_t>(at));
  for (std::size_t i = 0; i < whole; ++i) sum += chips[i];
  const double rest = at - static_cast<double>(whole);
  return sum + rest * chips[std::min(whole, n - 1)];
}

}  // namespace

std::vector<FoldedBin> fold(const std::vector<LightSample>& samples, const SlotCode& code,
                            int steps_per_chip, double clock_error, double origin_s) {
  const int steps = code.chips * steps_per_chip;
  const auto channels = static_cast<std::size_t>(code.channels);
  const double steps_per_s = code.chip_rate_hz * (1 + clock_error) * steps_per_chip;
  std::vector<FoldedBin> all(static_cast<std::size_t>(steps));
  for (const LightSample& sample : samples) {
    const double at = (sample.start_s - origin_s + 0.5 * sample.exposure_s) * steps_per_s;
    const double within = at - steps * std::floor(at / steps);
    const int step = std::min(steps - 1, static_cast<int>(within));
    FoldedBin& bin = all[step];
    bin.step = step;
    bin.weight.resize(channels, 0);
    bin.weighted.resize(channels, 0);
    const double weight = 1 / (sample.sigma * sample.sigma);
    bin.weight[sample.channel] += weight;
    bin.weighted[sample.channel] += weight * sample.value;
  }
  all.erase(std::remove_if(all.begin(), all.end(),
                           [](const FoldedBin& bin) { return bin.weight.empty(); }),
            all.end());
  return all;
}

PatternLight::PatternLight(const SlotCode& code, int steps_per_chip, double exposure_s) {
  const double half = 0.5 * std::max(1e-9, exposure_s * code.chip_rate_hz);
  for (const SlotPattern& pattern : code.patterns) {
    const auto steps = static_cast<Eigen::Index>(pattern.front().size()) * steps_per_chip;
    Eigen::MatrixXd light(steps, code.channels);
    for (Eigen::Index i = 0; i < steps; ++i) {
      const double middle = (static_cast<double>(i) + 0.5) / steps_per_chip;
      for (Eigen::Index c = 0; c < code.channels; ++c) {
        const std::vector<double>& chips = pattern[c];
        light(i, c) =
            (light_until(chips, middle + half) - light_until(chips, middle - half)) / (2 * half);
      }
    }
    light_.push_back(std::move(light));
  }
}

}  // namespace occ::internal::codes
