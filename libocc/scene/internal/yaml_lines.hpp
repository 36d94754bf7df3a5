// SPDX-License-Identifier: Apache-2.0
// Values as YAML text, and mappings of them line by line.
#pragma once

#include <Eigen/Core>
#include <string>

namespace occ::internal::scene {

/// The fewest digits that read back to the same double; zero has no sign.
std::string text_of(double value);

/// The fewest digits in degrees that read back to the same double in radians.
std::string degrees_text(double value_rad);

std::string quoted(const std::string& text);

template <typename List>
std::string list_text(const List& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + text_of(value);
  return "[" + text + "]";
}

/// Lines `key: value` of one mapping; a mapping inside a list starts with "- ".
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

}  // namespace occ::internal::scene
