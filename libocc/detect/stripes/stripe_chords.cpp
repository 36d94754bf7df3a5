// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/stripe_chords.hpp"

#include <algorithm>

namespace occ::internal::detect {
namespace {

/// Outermost crossings of `level` in a line; false when there are none inside the window.
bool crossings(const float* signal, int length, double level, double& first, double& last) {
  int a = 0, b = length - 1;
  while (a < length && !(signal[a] > level)) ++a;
  while (b > a && !(signal[b] > level)) --b;
  if (a == 0 || a >= length || b == length - 1 || b - a < 3) return false;
  first = a - (signal[a] - level) / (signal[a] - signal[a - 1]);
  last = b + (signal[b] - level) / (signal[b] - signal[b + 1]);
  return true;
}

/// Mean of the pixels of a line that reach more than half of its maximum.
double plateau(const float* signal, int length) {
  const float half = 0.5f * *std::max_element(signal, signal + length);
  double sum = 0;
  int count = 0;
  for (int i = 0; i < length; ++i) {
    if (!(signal[i] > half)) continue;
    sum += signal[i];
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

}  // namespace

std::vector<Chord> lit_chords(const LineWindow& window, const LineBox& part, double peak,
                              double fraction) {
  std::vector<Chord> chords;
  for (int line = part.line0; line <= part.line1; ++line) {
    const float* signal = window.line(line) + (part.pos0 - window.box.pos0);
    const int length = part.length();
    const double top = plateau(signal, length);
    if (top < 0.55 * peak) continue;
    double a, b, inner_a, inner_b, outer_a, outer_b;
    if (!crossings(signal, length, fraction * top, a, b) ||
        !crossings(signal, length, 0.75 * top, inner_a, inner_b) ||
        !crossings(signal, length, 0.25 * top, outer_a, outer_b))
      continue;
    const double soft = (outer_b - outer_a - (inner_b - inner_a)) / 2 / ((b - a) / 2);
    chords.push_back({line, part.pos0 + a, part.pos0 + b, soft});
  }
  return chords;
}

double median_softness(const std::vector<Chord>& chords) {
  std::vector<double> values;
  for (const Chord& chord : chords) values.push_back(chord.softness);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

int widest_gap(const std::vector<Chord>& chords) {
  int gap = 0;
  for (std::size_t i = 1; i < chords.size(); ++i)
    gap = std::max(gap, chords[i].line - chords[i - 1].line - 1);
  return gap;
}

}  // namespace occ::internal::detect
