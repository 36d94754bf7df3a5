// SPDX-License-Identifier: Apache-2.0
// Internal: the light of one lamp as a signal over lines, and the blink frequency in it.
//
// The frequency is found by a least-squares spectrum (Lomb, "Least-squares frequency analysis of
// unequally spaced data", Astrophysics and Space Science 39, 1976), generalised by a polynomial
// baseline and harmonics. A lamp shows only a few periods, for which the bins of a Fourier
// transform are as wide as the distance between the frequencies in use.
#pragma once

#include <array>
#include <complex>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ::internal::detect {

/// One value per line; lines with weight 0 are ignored.
struct LineSignal {
  int line0 = 0;
  std::vector<double> value, weight;

  int lines() const { return static_cast<int>(value.size()); }
};

/// Divides by the maximum within +-half_window_lines, so that the stripes of a bell-shaped profile
/// become equally high. A half window of 0.4 periods covers one stripe but not its neighbours.
/// Lines far below the maximum get a small weight.
LineSignal envelope_normalised(const LineSignal& signal, double half_window_lines);

/// value(line) = baseline + sum over k of a_k cos(k w (line - line0)) + b_k sin(...).
struct Blink {
  double cycles_per_line = 0;
  double sigma = 0;  ///< standard deviation of cycles_per_line
  static constexpr int max_harmonics = 6;
  int harmonics = 0;
  std::array<double, max_harmonics> cosine{}, sine{};
  int line0 = 0;
  double mean = 0;         ///< mean of the baseline
  double explained = 0;    ///< explained part of the variance about the baseline, 0..1
  double f_statistic = 0;  ///< F statistic of the periodic terms against the residual variance
  double periods = 0;      ///< number of visible periods

  /// Cycles from the maximum of the fundamental, in [-0.5, 0.5).
  double phase(double line) const;
  double amplitude() const;  ///< amplitude of the fundamental
};

/// Returns the frequency [cycles per line] with the largest power in a coarse scan, from about two
/// periods in view to the limit; 0 when the signal is too short.
double strongest_frequency(const LineSignal& signal, double max_cycles_per_line);

/// Returns the cosine (real) and sine (imaginary) amplitude at a known frequency.
std::complex<double> amplitude_at(const LineSignal& signal, double cycles_per_line);

/// Fits baseline, harmonics and frequency, starting at a coarse frequency.
Blink fit_blink(const LineSignal& signal, double cycles_per_line, int baseline_degree,
                int max_harmonics = Blink::max_harmonics);

}  // namespace occ::internal::detect
