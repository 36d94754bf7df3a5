// SPDX-License-Identifier: Apache-2.0
// One mapping of a YAML file, read key by key. Every complaint is a std::runtime_error
// "FILE:LINE: key `PATH`: REASON, got VALUE". Reading a key makes it known; `refuse_unknown` then
// complains about every other one and suggests a known key.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "libocc/scene/internal/yaml_node.hpp"

namespace occ::internal::scene {

class YamlSection {
 public:
  /// `path` is the section's own key with all its parents, empty for the whole file.
  YamlSection(std::shared_ptr<const YamlNode> node, int line, std::string file, std::string path);

  const std::string& file() const { return file_; }
  bool has(const std::string& key) const;

  /// Reads a key into `value` when it is there, else leaves `value` alone.
  void read(const std::string& key, int& value);
  void read(const std::string& key, double& value);
  void read(const std::string& key, std::string& value);
  void read(const std::string& key, Eigen::Vector2d& value);
  void read(const std::string& key, Eigen::Vector3d& value);
  void read(const std::string& key, std::vector<double>& value);
  void read(const std::string& key, std::vector<std::string>& value);
  template <typename T>
  void read(const std::string& key, std::optional<T>& value) {
    if (take(key)) read(key, value.emplace());
  }
  template <typename T>
  using Words = std::vector<std::pair<const char*, T>>;
  template <typename T>
  void read(const std::string& key, T& value, const Words<T>& words) {
    std::vector<std::string> names;
    for (const auto& word : words) names.emplace_back(word.first);
    if (const auto chosen = choice(key, names)) value = words[*chosen].second;
  }
  /// An angle of 0 to 90 degrees, both ends excluded.
  void read_half_angle(const std::string& key, double& value_rad);
  /// The half angle of a cone: 0 (excluded) to 180 degrees.
  void read_cone(const std::string& key, double& value_rad);

  /// The same, but the key must be there.
  template <typename... T>
  void need(const std::string& key, T&... value) {
    if (!has(key)) fail_missing(key);
    read(key, value...);
  }

  /// Sections below this one.
  YamlSection section(const std::string& key);
  std::vector<YamlSection> sections(const std::string& key);

  /// Runs `check`, which throws std::invalid_argument as core/require.hpp writes it, and tells the
  /// key of the field it names, or the key `otherwise` when the field has none.
  void check(const std::function<void()>& check, const std::string& otherwise = "") const;

  void refuse_unknown() const;

  [[noreturn]] void fail_missing(const std::string& key) const;
  [[noreturn]] void fail(const std::string& key, const std::string& reason) const;
  [[noreturn]] void fail_value(const std::string& key, const std::string& rule) const;

 private:
  [[noreturn]] void fail_unknown(const YamlNode::Entry& entry,
                                 const std::vector<std::string>& known) const;
  const YamlNode* take(const std::string& key);
  std::optional<long double> read_degrees(const std::string& key);
  const std::vector<std::shared_ptr<const YamlNode>>* take_list(const std::string& key,
                                                                const std::string& rule);
  std::optional<std::size_t> choice(const std::string& key, const std::vector<std::string>& words);
  void read_exactly(const std::string& key, int count, double* values);

  std::shared_ptr<const YamlNode> node_;
  int line_;
  std::string file_, path_;
  std::vector<std::string> known_;
};

/// Whether two keys differ in their unit alone, like `radius_mm` and `radius_m`.
bool differ_in_unit(const std::string& unknown, const std::string& known);

/// Which known key an unknown one was meant to be, as the end of a sentence: "write `radius_m`, in
/// metres", "did you mean `normal`?", "known here: ...".
std::string suggest_key(const std::string& unknown, const std::vector<std::string>& known);

}  // namespace occ::internal::scene
