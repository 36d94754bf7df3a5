// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/stripe_demodulation.hpp"

namespace occ::internal::detect {
namespace {

constexpr int max_lines = 512;  // of a signal: bounds the time that a huge body takes

/// Adds signal and model over samples [from, to) of a line; returns how many were used. The model
/// is exp(range (1 - across - along (pos - middle)^2)), run along the line by multiplication.
int add_samples(const LineWindow& window, int line, int from, int to,
                const OutlineChords::Chord& chord, double along, double range, double clipped,
                double& seen, double& expected) {
  const float* signal = window.line(line);
  const double step = window.stride, d = window.pos(from) - chord.middle;
  double value = std::exp(range * (1 - chord.across - along * d * d));
  double ratio = std::exp(-range * along * step * (2 * d + step));
  const double ratio_ratio = std::exp(-2 * range * along * step * step);
  int count = 0;
  for (int i = from; i < to; ++i, value *= ratio, ratio *= ratio_ratio) {
    if (range > 0 && signal[i] >= clipped) continue;
    seen += signal[i];
    expected += value;
    ++count;
  }
  return count;
}

}  // namespace

LineSignal compressed_signal(const LineWindow& window, const LineBox& all, double floor) {
  const int too_many = std::max(0, all.lines() - max_lines);
  const LineBox part = all.grown(-(too_many + 1) / 2, 0);
  const int from = window.sample_from(part.pos0);
  const int to = std::max(from + 1, window.sample_from(part.pos1 + 1));
  const int step = 1 + (to - from) / 48;
  const auto inverse = static_cast<float>(1 / floor);
  LineSignal signal;
  signal.line0 = part.line0;
  for (int line = part.line0; line <= part.line1; ++line) {
    const float* s = window.line(line);
    double sum = 0;
    int count = 0;
    for (int i = from; i < to; i += step, ++count)
      sum += std::log1p(std::max(0.0f, s[i]) * inverse);
    signal.value.push_back(sum / count);
    signal.weight.push_back(1);
  }
  return signal;
}

double dependable_part(const StripedShape& shape) {
  switch (shape.kind) {
    case StripedShape::Kind::disc:  // but for its blurred rim
      return 1 - 1.5 * std::sqrt((shape.shape.transpose() * shape.shape)(1, 1));
    case StripedShape::Kind::outline:  // sticks out of corners
      return 0.75;
    case StripedShape::Kind::glow:
      break;
  }
  return 0.9;
}

LineSignal demodulated_signal(const LineWindow& window, const StripedShape& shape, double clipped,
                              Side side) {
  const double range = shape.log_range;  // 0: evenly bright
  const OutlineChords chords(shape, dependable_part(shape));
  LineSignal signal;
  signal.line0 =
      std::max(window.box.line0, static_cast<int>(shape.centre[0] - chords.half_lines()));
  const int last = std::min({window.box.line1, signal.line0 + max_lines - 1,
                             static_cast<int>(shape.centre[0] + chords.half_lines())});
  for (int line = signal.line0; line <= last; ++line) {
    const OutlineChords::Chord chord = chords.at(line);
    const double low = side == Side::high ? chord.middle : chord.middle - chord.half;
    const double high = side == Side::low ? chord.middle : chord.middle + chord.half;
    double seen = 0, expected = 0;
    const int count = add_samples(window, line, window.sample_from(low), window.sample_from(high),
                                  chord, chords.along(), range, clipped, seen, expected);
    signal.value.push_back(count > 0 ? seen / expected : 0);
    signal.weight.push_back(count >= 3 ? 1 : 0);
  }
  return signal;
}

}  // namespace occ::internal::detect
