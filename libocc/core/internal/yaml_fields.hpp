// SPDX-License-Identifier: Apache-2.0
// Reads and writes plain structs as YAML mappings, by their lists of fields (fields.hpp). A key is
// the name of its field; a field with the rule Angle is in degrees: `cone_rad` has the key
// `cone_deg`.
#pragma once

#include <stdexcept>
#include <string>
#include <vector>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/yaml_lines.hpp"
#include "libocc/core/internal/yaml_section.hpp"

namespace occ::internal::core {

template <class Rule>
std::string file_key(const char* name, const Rule&) {
  std::string key = name;
  if constexpr (std::is_same_v<Rule, Angle>) key.replace(key.rfind("_rad"), 4, "_deg");
  return key;
}

template <class T, class Rule>
void read_field(YamlSection& section, const std::string& key, T& value, const Rule& rule) {
  if constexpr (std::is_same_v<Rule, Angle> && is_optional_v<T>) {
    if (section.has(key)) read_field(section, key, value.emplace(), rule);
  } else if constexpr (std::is_same_v<Rule, Angle>)
    section.read_angle(key, value, rule.limit_deg, rule.right);
  else if constexpr (std::is_enum_v<T>)
    section.read(key, value, rule.words);
  else
    section.read(key, value);
}

/// Reads all fields that apply to `object`, except those marked ByHand. Throws for a required key
/// that is missing and for values of a wrong type; validate() of the struct checks the rules.
/// is_set(name): true for fields that have a value already, so that their keys are optional.
template <class C, class... Fields, class IsSet>
void read_fields(YamlSection& section, C& object, const std::tuple<Fields...>& fields,
                 const IsSet& is_set) {
  for_each_field(fields, [&](const auto& field) {
    if constexpr (!std::is_same_v<std::decay_t<decltype(field.rule)>, ByHand>) {
      if (!field.applies_to(object)) return;
      const std::string key = file_key(field.name, field.rule);
      if (field.needed_in_files && !section.has(key) && !is_set(field.name))
        section.fail_missing(key);
      read_field(section, key, field.access(object), field.rule);
    }
  });
}

template <class C, class... Fields>
void read_fields(YamlSection& section, C& object, const std::tuple<Fields...>& fields) {
  read_fields(section, object, fields, [](const char*) { return false; });
}

/// Name of an enumerator. Throws std::invalid_argument for a value that is no enumerator.
template <class T, std::size_t count>
std::string word(const std::array<Word<T>, count>& words, T value) {
  for (const Word<T>& word : words)
    if (word.value == value) return word.text;
  throw std::invalid_argument("an enumerator without a name");
}

template <class T, class Rule>
std::string value_text(const T& value, const Rule& rule) {
  if constexpr (is_optional_v<T>)
    return value_text(*value, rule);
  else if constexpr (std::is_same_v<Rule, Angle>)
    return degrees_text(value);
  else if constexpr (std::is_enum_v<T>)
    return word(rule.words, value);
  else if constexpr (std::is_same_v<T, bool>)
    return value ? "true" : "false";
  else if constexpr (std::is_same_v<T, int>)
    return std::to_string(value);
  else if constexpr (std::is_same_v<T, double>)
    return text_of(value);
  else if constexpr (std::is_same_v<T, std::string>)
    return quoted(value);
  else
    return list_text(value);
}

/// Returns true for the values that a file omits: an optional without value, an empty text or list.
template <class T, class Rule>
bool is_left_out(const T& value, const Rule&) {
  if constexpr (is_optional_v<T>)
    return !value.has_value();
  else if constexpr (std::is_same_v<Rule, WrittenWhenEmpty>)
    return false;
  else if constexpr (std::is_same_v<T, std::string> || std::is_same_v<T, std::vector<double>> ||
                     std::is_same_v<T, std::vector<Eigen::Vector2d>> ||
                     std::is_same_v<T, std::vector<Eigen::Vector3d>>)
    return value.empty();
  else
    return false;
}

/// Writes the fields that apply to `object` in order. by_hand(name) is called in place of each
/// field marked ByHand.
template <class C, class... Fields, class ByHandWriter>
void write_fields(Lines& lines, const C& object, const std::tuple<Fields...>& fields,
                  const ByHandWriter& by_hand) {
  for_each_field(fields, [&](const auto& field) {
    if constexpr (std::is_same_v<std::decay_t<decltype(field.rule)>, ByHand>) {
      by_hand(field.name);
    } else {
      const auto& value = field.access(object);
      if (!field.applies_to(object) || is_left_out(value, field.rule)) return;
      lines.add(file_key(field.name, field.rule), value_text(value, field.rule));
    }
  });
}

template <class C, class... Fields>
void write_fields(Lines& lines, const C& object, const std::tuple<Fields...>& fields) {
  write_fields(lines, object, fields, [](const char*) {});
}

}  // namespace occ::internal::core
