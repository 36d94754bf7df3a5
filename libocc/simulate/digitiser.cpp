// SPDX-License-Identifier: Apache-2.0
#include "libocc/simulate/internal/digitiser.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/multiversion.hpp"

namespace occ {
namespace {

struct Line {
  double gain, offset, top;
};

template <typename Real>
LIBOCC_INLINE void line_levels(Line line, const Real* electrons, int count, std::uint16_t* levels) {
  const auto gain = static_cast<Real>(line.gain), offset = static_cast<Real>(line.offset);
  const auto top = static_cast<Real>(line.top);
  for (int i = 0; i < count; ++i) {
    const Real level = offset + gain * electrons[i] + Real(0.5);
    const Real above = level > 0 ? level : 0;
    levels[i] = static_cast<std::uint16_t>(static_cast<std::int32_t>(above < top ? above : top));
  }
}

template <Simd>
LIBOCC_INLINE void line_of_double_body(Line line, const double* electrons, int count,
                                       std::uint16_t* levels) {
  line_levels(line, electrons, count, levels);
}
LIBOCC_MULTIVERSION(line_of_double,
                    (Line line, const double* electrons, int count, std::uint16_t* levels),
                    (line, electrons, count, levels))

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
  if (sensor.response == Response::linear) return;
  bounds_e_.resize(static_cast<std::size_t>(levels_ - 1));
  for (int level = 0; level < levels_ - 1; ++level)
    bounds_e_[static_cast<std::size_t>(level)] = sensor.linear_dn(level + 0.5) / gain_;
}

double Digitiser::upper_bound_e(int level) const {
  return bounds_e_.empty() ? (level + 0.5 - black_) / gain_
                           : bounds_e_[static_cast<std::size_t>(level)];
}

int Digitiser::grey_level(double electrons) const {
  std::uint16_t level;
  grey_levels(Simd::baseline, &electrons, 1, &level);
  return level;
}

void Digitiser::grey_levels(Simd simd, const double* electrons, int count,
                            std::uint16_t* levels) const {
  if (bounds_e_.empty())
    return line_of_double_for(simd)({gain_, black_, levels_ - 0.5}, electrons, count, levels);
  for (int i = 0; i < count; ++i)
    levels[i] = static_cast<std::uint16_t>(
        std::upper_bound(bounds_e_.begin(), bounds_e_.end(), electrons[i]) - bounds_e_.begin());
}

void Digitiser::grey_levels(Simd simd, const float* electrons, int count,
                            std::uint16_t* levels) const {
  if (bounds_e_.empty())
    return line_of_float_for(simd)({gain_, black_, levels_ - 0.5}, electrons, count, levels);
  for (int i = 0; i < count; ++i)
    levels[i] = static_cast<std::uint16_t>(
        std::upper_bound(bounds_e_.begin(), bounds_e_.end(), static_cast<double>(electrons[i])) -
        bounds_e_.begin());
}

}  // namespace occ
