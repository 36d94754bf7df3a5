// SPDX-License-Identifier: Apache-2.0
// Values as YAML text, and the lines of a mapping.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::core {

/// Angles are radians in the library and degrees in files. The extended precision gives every angle
/// in radians a text in degrees that reads back to it. Pi is rounded to double, as in the usual
/// `degrees * pi / 180`.
constexpr long double radians_per_degree = static_cast<long double>(pi) / 180;

inline double radians(long double degrees) {
  return static_cast<double>(degrees * radians_per_degree);
}

/// The fewest digits that read back to the same double; -0 becomes 0.
LIBOCC_API std::string text_of(double value);

/// The fewest digits in degrees that read back to the same double in radians.
LIBOCC_API std::string degrees_text(double value_rad);

/// A YAML string in double quotes, with escapes for quotes, backslashes and control characters.
LIBOCC_API std::string quoted(const std::string& text);

template <typename List>
std::string list_text(const List& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + text_of(value);
  return "[" + text + "]";
}

template <int n>
std::string list_text(const std::vector<Eigen::Matrix<double, n, 1>>& values) {
  std::string text;
  for (const Eigen::Matrix<double, n, 1>& value : values)
    text += (text.empty() ? "" : ", ") + list_text(value);
  return "[" + text + "]";
}

/// Lines `key: value` of one mapping; the first line of a mapping inside a list starts with "- ".
class Lines {
 public:
  Lines(std::string& out, std::string indent) : out_(out), indent_(std::move(indent)) {}

  void add(const std::string& key, const std::string& value);
  void add(const std::string& key, double value) { add(key, text_of(value)); }
  void add(const std::string& key, int value) { add(key, std::to_string(value)); }
  void add(const std::string& key, const Eigen::Vector3d& v) { add(key, list_text(v)); }

 private:
  std::string& out_;
  std::string indent_;
};

}  // namespace occ::internal::core
