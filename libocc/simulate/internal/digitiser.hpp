// SPDX-License-Identifier: Apache-2.0
// Converts a pixel's electrons to its grey level: full well, response, quantisation. The inverse of
// the response (Sensor::linear_dn) gives the electrons at which one grey level ends and the next
// begins.
#pragma once

#include <cstdint>
#include <vector>

#include "libocc/core/simd.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::simulate {

class Digitiser {
 public:
  explicit Digitiser(const Sensor& sensor);

  int levels() const { return levels_; }

  /// Electrons at which grey level `level` ends, 0 <= level < levels() - 1. Negative values occur,
  /// because noise may make the signal negative.
  double upper_bound_e(int level) const;

  /// Grey level of a signal that the full well has already clipped, read noise included.
  int grey_level(double electrons) const;

  // Grey levels of many pixels. Up to one batch more is read and written.
  static constexpr int batch = 16;

  /// Levels of the sum of `base_e` and a signal, which this function clips at the full well.
  void grey_levels(Simd simd, double base_e, double full_well_e, const double* signal_e, int count,
                   std::uint16_t* levels) const;
  /// Levels of electrons that are already clipped, read noise included.
  void grey_levels(Simd simd, const float* electrons, int count, std::uint16_t* levels) const;

 private:
  int level_of(double electrons) const;  // by search in bounds_e_

  int levels_ = 0;
  double gain_ = 0, black_ = 0;
  std::vector<double> bounds_e_;  // empty for a linear response, where they are evenly spaced
};

}  // namespace occ::internal::simulate
