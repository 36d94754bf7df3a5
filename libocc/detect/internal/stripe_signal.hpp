// SPDX-License-Identifier: Apache-2.0
// Internal: the blink of one lamp as a signal over lines, and the frequency in it. A least-squares
// spectrum (Lomb 1976, generalised by a polynomial baseline and harmonics): a lamp shows only a few
// periods, for which the bins of a Fourier transform are as wide as the codes are apart.
#pragma once

#include <array>
#include <complex>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::detect {

/// One value per line; lines with weight 0 are not used.
struct LineSignal {
  int line0 = 0;
  std::vector<double> value, weight;

  int lines() const { return static_cast<int>(value.size()); }
};

/// Divides by the largest value within +-half a window, so that the stripes of a bell-shaped glow
/// become equally high: 0.4 periods reach over a stripe but not to its neighbours. Lines far below
/// the top get little weight.
LineSignal levelled(const LineSignal& signal, double half_window_lines);

/// value(line) = baseline + sum over k of a_k cos(k w (line - line0)) + b_k sin(...).
struct Blink {
  double cycles_per_line = 0;
  double sigma = 0;  ///< of cycles_per_line
  static constexpr int max_harmonics = 6;
  int harmonics = 0;
  std::array<double, max_harmonics> cosine{}, sine{};
  int line0 = 0;
  double mean = 0;       ///< of the baseline
  double explained = 0;  ///< part of the variance about the baseline, 0..1
  double f_test = 0;     ///< of the fundamental against baseline and noise
  double periods = 0;    ///< visible

  /// Cycles from the brightest phase of the fundamental, in [-0.5, 0.5).
  double phase(double line) const;
  double amplitude() const;  ///< of the fundamental
};

/// The strongest line of a coarse scan between two periods in view and the limit; 0 when the signal
/// is too short for one.
double strongest_line(const LineSignal& signal, double max_cycles_per_line);

/// Cosine and sine amplitude of a known frequency.
std::complex<double> amplitude_at(const LineSignal& signal, double cycles_per_line);

/// Fit of the blink near a coarse frequency.
Blink fit_blink(const LineSignal& signal, double cycles_per_line, int baseline_degree,
                int max_harmonics = Blink::max_harmonics);

}  // namespace occ::internal::detect
