// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/internal/slot_fit.hpp"

#include <Eigen/Core>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "libocc/codes/decode_samples.hpp"
#include "libocc/codes/slot_code.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/internal/dense.hpp"

namespace occ::internal::codes {
namespace {

/// Sums over the samples in one step of the period, by channel.
struct FoldedBin {
  int step = 0;
  std::vector<double> weight, weighted;  ///< sums of w and of w value, with w = 1 / sigma^2
};

/// Response of the camera: signal = offset + mixing * light.
struct Levels {
  Eigen::VectorXd offset;
  Eigen::MatrixXd mixing;

  explicit Levels(int channels)
      : offset(Eigen::VectorXd::Zero(channels)),
        mixing(Eigen::MatrixXd::Identity(channels, channels)) {}
};

/// Light of each pattern, averaged over an exposure about the middle of each step, by channel.
class PatternLight {
 public:
  PatternLight(const SlotCode& code, int steps_per_chip, double exposure_s);

  /// Light of a pattern; rows are steps, columns are channels.
  const Eigen::MatrixXd& of(int pattern) const { return light_[pattern]; }

 private:
  std::vector<Eigen::MatrixXd> light_;
};

/// Integral of the light of one channel up to a time [chips]. The first and last chip continue
/// beyond the pattern's ends.
double light_until(const std::vector<double>& chips, double at) {
  if (at <= 0) return at * chips.front();
  const auto n = chips.size();
  double sum = 0;
  const auto whole = std::min(n, static_cast<std::size_t>(at));
  for (std::size_t i = 0; i < whole; ++i) sum += chips[i];
  const double rest = at - static_cast<double>(whole);
  return sum + rest * chips[std::min(whole, n - 1)];
}

/// Folds samples into the period; returns the bins with samples, sorted by step.
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

/// The search over phases at one clock error.
class PhaseSearch {
 public:
  PhaseSearch(const SlotCode& code, const PatternLight& light, int steps_per_chip)
      : code_(code), light_(light), steps_(code.chips * steps_per_chip) {
    for (std::size_t s = 0; s < code.slots.size(); ++s)
      for (int i = 0; i < code.slot_chips(s) * steps_per_chip; ++i)
        place_.push_back({static_cast<int>(s), i});
  }

  int steps() const { return steps_; }

  /// Computes the expected signal of each pattern at each step.
  void set_levels(const Levels& levels) {
    expected_.clear();
    for (int p = 0; p < static_cast<int>(code_.patterns.size()); ++p)
      expected_.push_back((light_.of(p) * levels.mixing.transpose()).rowwise() +
                          levels.offset.transpose());
  }

  /// Returns the log likelihood of a phase up to a constant. Writes the evidence (value x symbol).
  double score(const std::vector<FoldedBin>& bins, int shift, Eigen::MatrixXd& evidence) const {
    evidence.setZero(code_.alphabet(), std::max(1, code_.symbols));
    double known = 0;
    for (const FoldedBin& bin : bins) {
      const Place at = place_[(bin.step + shift) % steps_];
      const Slot& slot = code_.slots[at.slot];
      if (slot.symbol < 0) {
        known += log_likelihood(bin, slot.first_pattern, at.step);
      } else {
        double* to = &evidence(0, slot.symbol);
        for (int value = 0; value < code_.alphabet(); ++value)
          to[value] += log_likelihood(bin, slot.first_pattern + value, at.step);
      }
    }
    return known + evidence.colwise().maxCoeff().sum();
  }

  /// Light transmitted in a bin for these symbol values.
  Eigen::RowVectorXd sent(const FoldedBin& bin, int shift, const std::vector<int>& values) const {
    const Place at = place_[(bin.step + shift) % steps_];
    const Slot& slot = code_.slots[at.slot];
    const int value = slot.symbol < 0 ? 0 : values[slot.symbol];
    return light_.of(slot.first_pattern + value).row(at.step);
  }

 private:
  struct Place {
    int slot, step;
  };

  double log_likelihood(const FoldedBin& bin, int pattern, int step) const {
    const Eigen::MatrixXd& expected = expected_[pattern];
    double sum = 0;
    for (std::size_t c = 0; c < bin.weight.size(); ++c) {
      const double level = expected(step, static_cast<Eigen::Index>(c));
      sum += level * (bin.weighted[c] - 0.5 * bin.weight[c] * level);
    }
    return sum;
  }

  const SlotCode& code_;
  const PatternLight& light_;
  int steps_;
  std::vector<Place> place_;
  std::vector<Eigen::MatrixXd> expected_;
};

struct Best {
  double total = -std::numeric_limits<double>::infinity();
  double clock_error = 0;
  int shift = 0;
};

std::vector<int> likeliest(const Eigen::MatrixXd& evidence, int symbols) {
  std::vector<int> values(static_cast<std::size_t>(symbols));
  for (int s = 0; s < symbols; ++s) {
    Eigen::Index best = 0;
    evidence.col(s).maxCoeff(&best);
    values[s] = static_cast<int>(best);
  }
  return values;
}

/// Estimates offset and mixing by least squares of the received on the transmitted light, with a
/// prior at the expected values for levels that the samples do not determine.
Levels estimate_levels(const PhaseSearch& search, const std::vector<FoldedBin>& bins,
                       const Best& best, const std::vector<int>& values, const SlotCode& code) {
  constexpr double prior_sigma = 0.3;  // of levels near 0 (dark) and 1 (lit)
  const int channels = code.channels;
  const bool mixes = channels == 3;
  const int terms = 1 + (mixes ? channels : 1);
  Levels levels(channels);
  for (int c = 0; c < channels; ++c) {
    Eigen::VectorXd expected = Eigen::VectorXd::Zero(terms);
    expected[1 + (mixes ? c : 0)] = 1;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Identity(terms, terms) / (prior_sigma * prior_sigma);
    Eigen::VectorXd right = normal * expected;
    for (const FoldedBin& bin : bins) {
      const Eigen::RowVectorXd sent = search.sent(bin, best.shift, values);
      Eigen::VectorXd row(terms);
      row[0] = 1;
      if (mixes)
        row.tail(channels) = sent.transpose();
      else
        row[1] = sent[c];
      normal += bin.weight[c] * row * row.transpose();
      right += bin.weighted[c] * row;
    }
    const Eigen::VectorXd estimate = core::solve_ldlt(normal, right);
    levels.offset[c] = estimate[0];
    if (mixes)
      levels.mixing.row(c) = estimate.tail(channels).transpose();
    else
      levels.mixing(c, c) = estimate[1];
  }
  return levels;
}

/// Chi-square explained by the best constant light of each channel, and chi-square of the samples.
struct Squares {
  double constant = 0, all = 0;
};
Squares squares_of(const std::vector<LightSample>& samples, int channels) {
  const auto n = static_cast<std::size_t>(channels);
  std::vector<double> weight(n, 0), weighted(n, 0);
  Squares squares;
  for (const LightSample& sample : samples) {
    const double w = 1 / (sample.sigma * sample.sigma);
    weight[sample.channel] += w;
    weighted[sample.channel] += w * sample.value;
    squares.all += w * sample.value * sample.value;
  }
  for (std::size_t c = 0; c < n; ++c)
    if (weight[c] > 0) squares.constant += weighted[c] * weighted[c] / weight[c];
  return squares;
}

/// Number of steps per chip. Codes whose light changes after few chips need more.
int steps_for(const SlotCode& code) {
  const double chips_per_slot = code.chips / static_cast<double>(code.slots.size());
  if (code.channels > 1) return code.channels == 2 ? 20 : 8;
  return chips_per_slot > 50 ? 2 : 4;
}

struct Times {
  double first_s = std::numeric_limits<double>::infinity();
  double last_s = -std::numeric_limits<double>::infinity();
};
Times times_of(const std::vector<LightSample>& samples) {
  Times times;
  for (const LightSample& sample : samples) {
    times.first_s = std::min(times.first_s, sample.start_s);
    times.last_s = std::max(times.last_s, sample.start_s);
  }
  return times;
}

/// Grid of clock errors; over the duration of the samples, neighbours differ by about two steps.
std::vector<double> clock_errors(const SlotCode& code, const DecodeSamplesOptions& options,
                                 double duration_s, int steps_per_chip) {
  if (options.period_start_s) return {0};
  const double max_error = options.max_clock_error;
  const double drift_steps = max_error * duration_s * code.chip_rate_hz * steps_per_chip;
  const int each_side = static_cast<int>(std::min(200.0, std::floor(drift_steps / 2 + 0.5)));
  std::vector<double> errors;
  for (int i = -each_side; i <= each_side; ++i)
    errors.push_back(each_side > 0 ? max_error * i / each_side : 0);
  return errors;
}

/// Symbol values of the phases that fit almost as well as the best one, where they differ from it:
/// with up to twice its residuals beyond the noise, `unexplained`. A phase that is shifted by one
/// slot has that much if the delimiter is over-exposed.
std::vector<std::vector<int>> rivals_of(const PhaseSearch& search,
                                        const std::vector<FoldedBin>& bins, const Best& best,
                                        const std::vector<int>& values,
                                        const std::vector<double>& totals, double unexplained) {
  constexpr double min_margin = 6;  // log likelihood ratio of two phases: 1 in 400
  const double limit = min_margin + 0.5 * std::max(0.0, unexplained);
  Eigen::MatrixXd evidence;
  std::vector<std::vector<int>> rivals;
  for (int shift = 0; shift < search.steps(); ++shift) {
    if (shift == best.shift || best.total - totals[shift] >= limit) continue;
    search.score(bins, shift, evidence);
    std::vector<int> others = likeliest(evidence, static_cast<int>(values.size()));
    if (others != values) rivals.push_back(std::move(others));
  }
  return rivals;
}

}  // namespace

SlotFit fit_slots(const std::vector<LightSample>& samples, const SlotCode& code,
                  const DecodeSamplesOptions& options) {
  const int steps_per_chip = steps_for(code);
  const PatternLight light(code, steps_per_chip, samples.front().exposure_s);
  PhaseSearch search(code, light, steps_per_chip);
  Levels levels(code.channels);
  search.set_levels(levels);
  const Times times = times_of(samples);
  // The origin is the middle of the samples, where a clock error changes the phase least.
  const double origin_s = options.period_start_s.value_or(0.5 * (times.first_s + times.last_s));
  std::vector<double> errors =
      clock_errors(code, options, times.last_s - times.first_s, steps_per_chip);
  const int shifts = options.period_start_s ? 1 : search.steps();

  Best best;
  Eigen::MatrixXd evidence;
  std::vector<double> totals(static_cast<std::size_t>(search.steps()),
                             -std::numeric_limits<double>::infinity());
  SlotFit fit;
  const int passes = code.channels == 3 ? 4 : 2;
  for (int pass = 0; pass < passes; ++pass) {
    best = {};
    for (const double error : errors) {
      const auto bins = fold(samples, code, steps_per_chip, error, origin_s);
      for (int shift = 0; shift < shifts; ++shift) {
        const double total = search.score(bins, shift, evidence);
        if (total > best.total) best = {total, error, shift};
      }
    }
    const auto bins = fold(samples, code, steps_per_chip, best.clock_error, origin_s);
    search.score(bins, best.shift, evidence);
    fit.values = likeliest(evidence, code.symbols);
    if (pass + 1 < passes) {
      levels = estimate_levels(search, bins, best, fit.values, code);
      search.set_levels(levels);
      errors = {best.clock_error};
      continue;
    }
    for (int shift = 0; shift < shifts; ++shift)
      totals[shift] = search.score(bins, shift, evidence);
    fit.total = best.total = totals[best.shift];
    const Squares squares = squares_of(samples, code.channels);
    fit.gained = 2 * fit.total - squares.constant;
    fit.excess = squares.all - squares.constant - static_cast<double>(samples.size());
    fit.rivals = rivals_of(search, bins, best, fit.values, totals, fit.excess - fit.gained);
    search.score(bins, best.shift, evidence);
  }
  fit.clock_error = best.clock_error;
  fit.shift = best.shift;
  for (int s = 0; s < code.symbols; ++s)
    fit.evidence.emplace_back(evidence.col(s).begin(), evidence.col(s).end());
  return fit;
}

std::vector<double> bit_evidence(const std::vector<std::vector<double>>& evidence,
                                 int bits_per_symbol) {
  std::vector<double> bits;
  for (const std::vector<double>& symbol : evidence)
    for (int b = bits_per_symbol - 1; b >= 0; --b) {
      constexpr double none = -std::numeric_limits<double>::infinity();
      double best[2] = {none, none};
      for (std::size_t value = 0; value < symbol.size(); ++value)
        best[(value >> b) & 1] = std::max(best[(value >> b) & 1], symbol[value]);
      bits.push_back(best[1] - best[0]);
    }
  return bits;
}

}  // namespace occ::internal::codes
