// SPDX-License-Identifier: Apache-2.0
// Internal: table of the normal density and distribution, linearly interpolated, accurate to 1e-5.
// An edge profile is evaluated some thousand times for each lamp; std::erf would dominate the time.
#pragma once

#include <array>
#include <cmath>

#include "libocc/core/math.hpp"

namespace occ::internal::detect {

class NormalTable {
 public:
  struct Value {
    double density;  ///< exp(-z^2/2) / sqrt(2 pi)
    double below;    ///< probability of a value less than z
  };

  static const NormalTable& get() {
    static const NormalTable table;
    return table;
  }

  Value operator()(double z) const {
    const double at = (z + reach) * steps;
    if (!(at > 0)) return {0, 0};
    if (at >= size) return {0, 1};
    const auto i = static_cast<std::size_t>(at);
    const double part = at - static_cast<double>(i);
    const Value& a = values_[i];
    const Value& b = values_[i + 1];
    return {a.density + part * (b.density - a.density), a.below + part * (b.below - a.below)};
  }

 private:
  static constexpr int reach = 6;   // half width of the table [sigma]
  static constexpr int steps = 64;  // entries per sigma
  static constexpr int size = 2 * reach * steps;

  NormalTable() {
    for (int i = 0; i <= size; ++i) {
      const double z = static_cast<double>(i) / steps - reach;
      values_[i] = {std::exp(-0.5 * z * z) / std::sqrt(2 * pi), 0.5 * std::erfc(-z / M_SQRT2)};
    }
  }

  std::array<Value, size + 1> values_;
};

}  // namespace occ::internal::detect
