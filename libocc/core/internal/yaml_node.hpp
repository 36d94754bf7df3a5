// SPDX-License-Identifier: Apache-2.0
// A YAML document as a tree with line numbers. Files are untrusted input: size, nesting and the
// number of values are bounded, and aliases share their node instead of copying it.
#pragma once

#include <memory>
#include <string>
#include <vector>

namespace occ::internal::core {

struct YamlNode {
  enum class Kind { nothing, scalar, sequence, mapping };
  struct Entry {
    std::string key;
    int line = 0;
    std::shared_ptr<const YamlNode> value;
  };

  Kind kind = Kind::nothing;
  int line = 0;      ///< line number, from 1
  std::string text;  ///< content of a scalar
  std::vector<std::shared_ptr<const YamlNode>> items;
  std::vector<Entry> entries;

  const Entry* find(const std::string& key) const;

  /// Description for messages: the scalar itself (shortened, printable), "a list of 3", "a
  /// mapping", "nothing".
  std::string describe() const;
};

/// Throws std::runtime_error "NAME:LINE: REASON" when `text` is not one YAML document whose root is
/// a mapping.
std::shared_ptr<const YamlNode> parse_yaml(const std::string& text, const std::string& name);

/// Reads and parses a file. Throws std::runtime_error also for files larger than 4 MiB.
std::shared_ptr<const YamlNode> read_yaml(const std::string& path);

/// Shortens a text for a one-line message and replaces its control characters.
std::string printable(const std::string& text);

}  // namespace occ::internal::core
