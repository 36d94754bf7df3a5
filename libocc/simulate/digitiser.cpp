// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/digitiser.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/internal/multiversion.hpp"

namespace occ::internal::simulate {
namespace {

struct Line {
  double gain, offset, top;
};

// The highest level ends above every signal.
Line line_of(double gain, double black, int levels) { return {gain, black, levels - 0.5}; }

// Works on whole batches, because single pixels at the end would take as long as the rest.
template <typename Real>
LIBOCC_INLINE void line_levels(Line line, const Real* electrons, int count,
                               std::uint16_t* __restrict levels) {
  const auto gain = static_cast<Real>(line.gain), offset = static_cast<Real>(line.offset);
  const auto top = static_cast<Real>(line.top);
  for (int first = 0; first < count; first += Digitiser::batch)
    for (int i = first; i < first + Digitiser::batch; ++i) {
      const Real level = offset + gain * electrons[i] + Real(0.5);
      const Real above = level > 0 ? level : 0;
      levels[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(above < top ? above : top));
    }
}

// Adds the signal to `base` and clips it at the full well first.
template <Simd>
LIBOCC_INLINE void line_of_signal_body(Line line, double base, double full_well,
                                       const double* signal, int count,
                                       std::uint16_t* __restrict levels) {
  for (int first = 0; first < count; first += Digitiser::batch) {
    double electrons[Digitiser::batch];
    for (int i = 0; i < Digitiser::batch; ++i) {
      const double all = base + signal[first + i];
      electrons[i] = all < full_well ? all : full_well;
    }
    line_levels(line, electrons, Digitiser::batch, levels + first);
  }
}
LIBOCC_MULTIVERSION(line_of_signal,
                    (Line line, double base, double full_well, const double* signal, int count,
                     std::uint16_t* levels),
                    (line, base, full_well, signal, count, levels))

template <Simd>
LIBOCC_INLINE void line_of_float_body(Line line, const float* electrons, int count,
                                      std::uint16_t* levels) {
  line_levels(line, electrons, count, levels);
}
LIBOCC_MULTIVERSION(line_of_float,
                    (Line line, const float* electrons, int count, std::uint16_t* levels),
                    (line, electrons, count, levels))

}  // namespace

Digitiser::Digitiser(const Sensor& sensor)
    : levels_(static_cast<int>(sensor.full_scale_dn()) + 1),
      gain_(sensor.gain_dn_per_e),
      black_(sensor.black_level_dn) {
  if (sensor.is_linear()) return;
  bounds_e_.resize(static_cast<std::size_t>(levels_ - 1));
  for (int level = 0; level < levels_ - 1; ++level)
    bounds_e_[level] = sensor.linear_dn(level + 0.5) / gain_;
}

double Digitiser::upper_bound_e(int level) const {
  return bounds_e_.empty() ? (level + 0.5 - black_) / gain_ : bounds_e_[level];
}

int Digitiser::level_of(double electrons) const {
  return static_cast<int>(std::upper_bound(bounds_e_.begin(), bounds_e_.end(), electrons) -
                          bounds_e_.begin());
}

int Digitiser::grey_level(double electrons) const {
  if (!bounds_e_.empty()) return level_of(electrons);
  std::array<double, batch> all;
  all.fill(electrons);
  std::array<std::uint16_t, batch> levels;
  line_levels<double>(line_of(gain_, black_, levels_), all.data(), 1, levels.data());
  return levels[0];
}

void Digitiser::grey_levels(Simd simd, double base_e, double full_well_e, const double* signal_e,
                            int count, std::uint16_t* levels) const {
  if (bounds_e_.empty())
    return line_of_signal_for(simd)(line_of(gain_, black_, levels_), base_e, full_well_e, signal_e,
                                    count, levels);
  for (int i = 0; i < count; ++i)
    levels[i] = static_cast<std::uint16_t>(level_of(std::min(base_e + signal_e[i], full_well_e)));
}

void Digitiser::grey_levels(Simd simd, const float* electrons, int count,
                            std::uint16_t* levels) const {
  if (bounds_e_.empty())
    return line_of_float_for(simd)(line_of(gain_, black_, levels_), electrons, count, levels);
  for (int i = 0; i < count; ++i)
    levels[i] = static_cast<std::uint16_t>(level_of(static_cast<double>(electrons[i])));
}

}  // namespace occ::internal::simulate
