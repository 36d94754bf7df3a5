// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/yaml_lines.hpp"

#include <array>
#include <charconv>

namespace occ::internal::core {

std::string text_of(double value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value + 0.0).ptr;
  return {digits.data(), end};
}

std::string degrees_text(double value_rad) {
  const long double degrees = static_cast<long double>(value_rad) / radians_per_degree;
  std::array<char, 64> digits{};
  for (int precision = 3;; ++precision) {
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), degrees,
                                   std::chars_format::general, precision)
                         .ptr;
    long double read = 0;
    std::from_chars(digits.data(), end, read);
    if (radians(read) == value_rad || precision == 21) return {digits.data(), end};
  }
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (byte < 0x20 || byte == 0x7f) {
      constexpr char hex[] = "0123456789abcdef";
      out += {'\\', 'x', hex[byte / 16], hex[byte % 16]};
    } else {
      out += c;
    }
  }
  return out + '"';
}

void Lines::add(const std::string& key, const std::string& value) {
  out_ += indent_ + key + ": " + value + "\n";
  if (const auto dash = indent_.find('-'); dash != std::string::npos) indent_[dash] = ' ';
}

}  // namespace occ::internal::core
