// SPDX-License-Identifier: Apache-2.0
// Strict reading of one mapping of a YAML file, key by key. Every error is a std::runtime_error
// "FILE:LINE: key `PATH`: REASON, got VALUE". A key that has been read is known; `reject_unknown`
// then rejects every other key of the mapping and suggests a known one.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/internal/yaml_node.hpp"
#include "libocc/core/per_axis.hpp"

namespace occ::internal::core {

class YamlSection {
 public:
  /// `path` is the section's own key with all its parents, empty for the whole file.
  YamlSection(std::shared_ptr<const YamlNode> node, int line, std::string file, std::string path);

  const std::string& file() const { return file_; }
  bool has(const std::string& key) const;
  /// True for a key whose value is a mapping.
  bool is_mapping(const std::string& key) const;

  /// Reads a key into `value` if it is present; otherwise `value` keeps its content.
  void read(const std::string& key, bool& value);
  void read(const std::string& key, int& value);
  void read(const std::string& key, double& value);
  void read(const std::string& key, std::string& value);
  void read(const std::string& key, Eigen::Vector2d& value);
  void read(const std::string& key, Eigen::Vector3d& value);
  void read(const std::string& key, PerAxis& value);
  void read(const std::string& key, std::vector<double>& value);
  void read(const std::string& key, std::vector<Eigen::Vector2d>& value);
  void read(const std::string& key, std::vector<Eigen::Vector3d>& value);
  void read(const std::string& key, std::vector<std::string>& value);
  template <typename T>
  void read(const std::string& key, std::optional<T>& value) {
    if (take(key)) read(key, value.emplace());
  }
  /// Reads an enumerator by its name; words: an array of Word<T> (fields.hpp).
  template <typename T, typename Words>
  void read(const std::string& key, T& value, const Words& words) {
    std::vector<std::string> names;
    for (const auto& word : words) names.emplace_back(word.text);
    if (const auto chosen = choice(key, names)) value = words[*chosen].value;
  }
  /// Reads an angle in degrees: greater than 0 and less than limit_deg, or equal to it where
  /// `right` is ']'.
  void read_angle(const std::string& key, double& value_rad, int limit_deg, char right);

  /// Reads a key that must be present.
  template <typename... T>
  void need(const std::string& key, T&... value) {
    if (!has(key)) fail_missing(key);
    read(key, value...);
  }

  /// Reads the key `schema`, a name with a version such as `libocc-scene/1`. Throws for another
  /// name and for a version greater than `newest`. prefix: the name with its slash.
  void require_schema(const std::string& prefix, int newest);

  /// The mapping below a key, or the mappings in a list below it. Throws when the key is missing.
  YamlSection section(const std::string& key);
  std::vector<YamlSection> sections(const std::string& key);

  /// Runs `check`. Its std::invalid_argument, worded as in core/require.hpp, becomes an error of
  /// the key that it names, or of the key `otherwise` when there is no such key.
  void check(const std::function<void()>& check, const std::string& otherwise = "") const;

  void reject_unknown() const;

  [[noreturn]] void fail_missing(const std::string& key) const;
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;
  /// Fails with the value that the file gives for a present key.
  [[noreturn]] void fail_value(const std::string& key, const std::string& rule) const;

 private:
  [[noreturn]] void fail_unknown(const YamlNode::Entry& entry,
                                 const std::vector<std::string>& known) const;
  const YamlNode* take(const std::string& key);
  const std::vector<std::shared_ptr<const YamlNode>>* take_list(const std::string& key,
                                                                const std::string& rule);
  std::optional<std::size_t> choice(const std::string& key, const std::vector<std::string>& names);
  void read_exactly(const std::string& key, std::size_t count, double* values);
  template <typename Vector>
  void read_vectors(const std::string& key, std::vector<Vector>& value);

  std::shared_ptr<const YamlNode> node_;
  int line_;
  std::string file_, path_;
  std::vector<std::string> known_;
};

/// Returns true when two keys differ in their unit only, like `radius_mm` and `radius_m`.
bool differ_in_unit(const std::string& unknown, const std::string& known);

/// Names the known key that an unknown one resembles, as the end of a sentence: "write
/// `radius_m`, in metres", "did you mean `normal`?", or "known here: ...".
std::string suggest_key(const std::string& unknown, const std::vector<std::string>& known);

}  // namespace occ::internal::core
