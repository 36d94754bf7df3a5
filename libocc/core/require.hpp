// SPDX-License-Identifier: Apache-2.0
// Checks of arguments: throw std::invalid_argument with the name and the value of the argument.
#pragma once

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "libocc/core/abi.hpp"

namespace occ {

/// Throws std::invalid_argument "`name` must be `rule`, got `value`" unless `holds`. Write ranges
/// so that NaN fails: `require(radius_m > 0, "radius_m", radius_m, "positive")`.
template <typename T>
void require(bool holds, std::string_view name, const T& value, std::string_view rule) {
  if (holds) return;
  std::ostringstream text;
  text << name << " must be " << rule << ", got " << value;
  throw std::invalid_argument(text.str());
}

/// Throws std::invalid_argument unless the value is finite and positive.
inline void require_positive(double value, std::string_view name) {
  require(std::isfinite(value) && value > 0, name, value, "positive");
}

/// Throws std::invalid_argument unless the value is finite and not negative.
inline void require_not_negative(double value, std::string_view name) {
  require(std::isfinite(value) && value >= 0, name, value, "finite and >= 0");
}

/// Throws std::invalid_argument with the index of the first column that contains NaN or infinity.
template <typename Matrix>
void require_finite(const Matrix& columns, std::string_view name) {
  if (columns.allFinite()) return;
  for (decltype(columns.cols()) i = 0; i < columns.cols(); ++i)
    require(columns.col(i).allFinite(), std::string(name) + "[" + std::to_string(i) + "]",
            columns.col(i).transpose(), "finite");
}

}  // namespace occ
