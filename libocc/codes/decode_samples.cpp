// SPDX-License-Identifier: Apache-2.0
#include "libocc/codes/decode_samples.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "libocc/codes/code_kinds.hpp"
#include "libocc/codes/internal/slot_fit.hpp"
#include "libocc/core/require.hpp"

namespace occ {

using namespace internal::codes;
namespace {

// In pure noise the decisions explain about one unit of chi-square per bit, and the choice of the
// phase a few more.
bool contains_code(const SlotFit& fit, std::size_t bits) {
  return fit.gained > 4 * (static_cast<double>(bits) + 10);
}

/// Log likelihood ratios of the payload's bits, with the statistics for the verdict.
struct Evidence {
  std::vector<double> bits;  ///< log likelihood ratio of 1 against 0
  std::vector<Bits> rivals;  ///< bits of other phases that fit almost as well
  double gained = 0, excess = 0, clock_error = 0;
  bool found = false;
};

/// Bits of symbol values, most significant bit first; the inverse of symbols_of().
Bits bits_of(const std::vector<int>& values, int bits_per_symbol) {
  Bits bits;
  for (const int value : values)
    for (int k = bits_per_symbol - 1; k >= 0; --k) bits.push_back((value >> k) & 1);
  return bits;
}

Evidence joined_evidence(const std::vector<LightSample>& samples, const Code& code,
                         const DecodeSamplesOptions& options) {
  const SlotCode slots = slot_code(code);
  const SlotFit fit = fit_slots(samples, slots, options);
  Evidence evidence;
  evidence.bits = bit_evidence(fit.evidence, slots.bits_per_symbol);
  evidence.gained = fit.gained;
  evidence.excess = fit.excess;
  for (const std::vector<int>& values : fit.rivals)
    evidence.rivals.push_back(bits_of(values, slots.bits_per_symbol));
  evidence.clock_error = fit.clock_error;
  evidence.found = contains_code(fit, evidence.bits.size());
  return evidence;
}

/// Probability of each word of `count` bits, from the log likelihood ratios of the bits.
std::vector<double> word_probabilities(const std::vector<double>& bits, std::size_t from,
                                       std::size_t count) {
  std::vector<double> p(std::size_t{1} << count);
  for (std::size_t word = 0; word < p.size(); ++word) {
    double log_p = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const bool one = (word >> (count - 1 - i)) & 1;
      log_p -= std::log1p(std::exp(std::clamp(one ? -bits[from + i] : bits[from + i], -50., 50.)));
    }
    p[word] = std::exp(log_p);
  }
  return p;
}

/// Adds the log likelihoods of one frame for the words of all sub-packets. A frame shows one
/// sub-packet; with a small probability it is uninformative, because it shows the end of one
/// sub-packet and the beginning of the next.
void add_frame(const SlotFit& fit, const SlotCode& slots, const Code& code,
               std::vector<std::vector<double>>& words) {
  constexpr double uninformative = 0.05;
  const std::vector<double> bits = bit_evidence(fit.evidence, slots.bits_per_symbol);
  const auto sequence_bits = static_cast<std::size_t>(c_ook_sequence_bits(code));
  const auto number = word_probabilities(bits, 0, sequence_bits);
  const auto word = word_probabilities(bits, sequence_bits, 4);
  for (std::size_t s = 0; s < words.size(); ++s)
    for (std::size_t w = 0; w < words[s].size(); ++w) {
      const double weight = (1 - uninformative) * number[s];
      words[s][w] += std::log(weight * word[w] + (1 - weight) / 16);
    }
}

Evidence frame_by_frame(const std::vector<LightSample>& samples, const Code& code,
                        const DecodeSamplesOptions& options) {
  const SlotCode slots = c_ook_sub_packet_slots(code);
  std::map<int, std::vector<LightSample>> frames;
  for (const LightSample& sample : samples) frames[sample.frame].push_back(sample);
  std::vector<std::vector<double>> words(static_cast<std::size_t>(c_ook_sub_packets(code)),
                                         std::vector<double>(16, 0));
  Evidence evidence;
  for (const auto& [frame, of_frame] : frames) {
    const SlotFit fit = fit_slots(of_frame, slots, options);
    if (!contains_code(fit, static_cast<std::size_t>(c_ook_sequence_bits(code) + 4))) continue;
    evidence.found = true;
    evidence.gained += fit.gained;
    evidence.excess += fit.excess;
    add_frame(fit, slots, code, words);
  }
  evidence.bits = bit_evidence(words, 4);
  return evidence;
}

std::string number_text(double value) {
  std::ostringstream text;
  text.precision(3);
  text << value;
  return text.str();
}

/// Sets status, message and id.
void set_status(const Evidence& evidence, const Code& code, const DecodeSamplesOptions& options,
                DecodedCode& out) {
  constexpr double min_explained = 0.5;  // min explained part of the variance
  const auto unseen = std::count_if(out.margins.begin(), out.margins.end(),
                                    [](double margin) { return margin < 1e-6; });
  const auto verdict = [&](CodeStatus status, std::string message) {
    out.status = status;
    out.message = std::move(message);
  };
  if (!evidence.found)
    return verdict(CodeStatus::no_signal,
                   std::string("the light contains no ") + to_string(code.kind) + " code");
  if (unseen > 0)
    return verdict(CodeStatus::incomplete, std::to_string(unseen) + " of " +
                                               std::to_string(out.bits.size()) +
                                               " bits were not observed: more frames are needed");
  if (out.explained < min_explained)
    return verdict(CodeStatus::no_signal, "the code explains only " + number_text(out.explained) +
                                              " of the variance of the light");
  if (out.expected_errors > options.max_expected_errors)
    return verdict(CodeStatus::uncertain,
                   number_text(out.expected_errors) + " wrong bits are expected");
  const auto has_checksum = [&](const Bits& bits) {
    const Bits id(bits.begin(), bits.begin() + code.id_bits);
    return payload_bits(value_of(id), code) == bits;
  };
  if (!has_checksum(out.bits)) return verdict(CodeStatus::checksum_failed, "the checksum is wrong");
  if (std::any_of(evidence.rivals.begin(), evidence.rivals.end(), has_checksum))
    return verdict(CodeStatus::uncertain, "another phase with other bits fits equally well");
  const Bits id(out.bits.begin(), out.bits.begin() + code.id_bits);
  verdict(CodeStatus::ok, "");
  out.id = value_of(id);
}

void check(const std::vector<LightSample>& samples, const SlotCode& slots) {
  for (const LightSample& sample : samples) {
    require(std::isfinite(sample.start_s), "start_s", sample.start_s, "finite");
    require(std::isfinite(sample.value), "value", sample.value, "finite");
    require(sample.sigma > 0 && std::isfinite(sample.sigma), "sigma", sample.sigma, "positive");
    require(sample.exposure_s > 0 && std::isfinite(sample.exposure_s), "exposure_s",
            sample.exposure_s, "positive");
    require(sample.channel >= 0 && sample.channel < slots.channels, "channel", sample.channel,
            "below the code's " + std::to_string(slots.channels));
  }
}

}  // namespace

const char* to_string(CodeStatus status) {
  constexpr std::array<const char*, 5> names{"ok", "no_signal", "incomplete", "uncertain",
                                             "checksum_failed"};
  return names[static_cast<std::size_t>(status)];
}

void DecodeSamplesOptions::validate() const {
  require(max_clock_error >= 0 && max_clock_error < 0.01, "max_clock_error", max_clock_error,
          "in [0, 0.01)");
  require(max_expected_errors > 0, "max_expected_errors", max_expected_errors, "positive");
  if (period_start_s)
    require(std::isfinite(*period_start_s), "period_start_s", *period_start_s, "finite");
}

DecodedCode decode_samples(const std::vector<LightSample>& samples, const Code& code,
                           const DecodeSamplesOptions& options) {
  options.validate();
  check(samples, slot_code(code));
  DecodedCode out;
  if (samples.empty()) {
    out.message = "no samples";
    return out;
  }
  const bool by_frame =
      code.kind == CodeKind::c_ook && !options.exact_times && !options.period_start_s;
  const Evidence evidence =
      by_frame ? frame_by_frame(samples, code, options) : joined_evidence(samples, code, options);
  for (const double bit : evidence.bits) {
    out.bits.push_back(bit > 0);
    out.margins.push_back(std::abs(bit));
    out.expected_errors += 1 / (1 + std::exp(std::min(500.0, std::abs(bit))));
  }
  out.explained = evidence.excess > 0 ? std::min(1.0, evidence.gained / evidence.excess) : 0;
  out.clock_error = evidence.clock_error;
  std::map<int, int> frames;
  for (const LightSample& sample : samples) ++frames[sample.frame];
  out.frames = static_cast<int>(frames.size());
  set_status(evidence, code, options, out);
  return out;
}

}  // namespace occ
