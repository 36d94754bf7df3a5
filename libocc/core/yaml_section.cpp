// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/yaml_section.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>
#include <unordered_map>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/yaml_lines.hpp"

namespace occ::internal::core {
namespace {

template <typename T>
std::optional<T> number_of(const YamlNode& node) {
  if (node.kind != YamlNode::Kind::scalar || node.text.empty()) return std::nullopt;
  const char* begin = node.text.data();
  const char* end = begin + node.text.size();
  if (*begin == '+') ++begin;
  T value{};
  const auto parsed = std::from_chars(begin, end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return value;
}

std::optional<double> finite_number(const YamlNode& node) {
  const auto value = number_of<double>(node);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

// The field in a message: "lamp 3: radius_m", "sensor.response_table[2]", "distortion's length".
std::string field_of(std::string name) {
  if (const auto colon = name.rfind(": "); colon != std::string::npos) name.erase(0, colon + 2);
  name.erase(std::min(name.size(), name.find_first_of("[' ")));
  if (const auto dot = name.rfind('.'); dot != std::string::npos) name.erase(0, dot + 1);
  return name;
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

}  // namespace

YamlSection::YamlSection(std::shared_ptr<const YamlNode> node, int line, std::string file,
                         std::string path)
    : node_(std::move(node)), line_(line), file_(std::move(file)), path_(std::move(path)) {
  std::unordered_map<std::string, int>
      line_of;  // find() for each of many keys takes quadratic time
  for (const YamlNode::Entry& entry : node_->entries) {
    const auto [first, is_new] = line_of.emplace(entry.key, entry.line);
    if (!is_new) fail(entry.key, "is given twice, first in line " + std::to_string(first->second));
  }
}

bool YamlSection::has(const std::string& key) const { return node_->find(key) != nullptr; }

bool YamlSection::is_mapping(const std::string& key) const {
  const YamlNode::Entry* entry = node_->find(key);
  return entry && entry->value->kind == YamlNode::Kind::mapping;
}

const YamlNode* YamlSection::take(const std::string& key) {
  known_.push_back(key);
  const YamlNode::Entry* entry = node_->find(key);
  return entry ? entry->value.get() : nullptr;
}

const std::vector<std::shared_ptr<const YamlNode>>* YamlSection::take_list(
    const std::string& key, const std::string& rule) {
  const YamlNode* node = take(key);
  if (!node) return nullptr;
  if (node->kind != YamlNode::Kind::sequence) fail_value(key, rule);
  return &node->items;
}

void YamlSection::read(const std::string& key, bool& value) {
  constexpr std::array<Word<bool>, 2> words{{{"false", false}, {"true", true}}};
  read(key, value, words);
}

void YamlSection::read(const std::string& key, int& value) {
  const YamlNode* node = take(key);
  if (!node) return;
  const auto number = number_of<int>(*node);
  if (!number) fail_value(key, "must be a whole number");
  value = *number;
}

void YamlSection::read(const std::string& key, double& value) {
  const YamlNode* node = take(key);
  if (!node) return;
  const auto number = finite_number(*node);
  if (!number) fail_value(key, "must be a finite number");
  value = *number;
}

void YamlSection::read(const std::string& key, std::string& value) {
  const YamlNode* node = take(key);
  if (!node) return;
  if (node->kind != YamlNode::Kind::scalar) fail_value(key, "must be a text");
  value = node->text;
}

void YamlSection::read_exactly(const std::string& key, std::size_t count, double* values) {
  const std::string rule = "must be a list of " + std::to_string(count) + " finite numbers";
  const auto* items = take_list(key, rule);
  if (!items) return;
  if (items->size() != count) fail_value(key, rule);
  for (const auto& item : *items) {
    const auto number = finite_number(*item);
    if (!number) fail(key, rule + ", got " + item->describe() + " in it");
    *values++ = *number;
  }
}

void YamlSection::read(const std::string& key, Eigen::Vector2d& value) {
  read_exactly(key, 2, value.data());
}

void YamlSection::read(const std::string& key, Eigen::Vector3d& value) {
  read_exactly(key, 3, value.data());
}

void YamlSection::read(const std::string& key, PerAxis& value) {
  const YamlNode* node = take(key);
  if (!node) return;
  if (node->kind == YamlNode::Kind::sequence) return read_exactly(key, 3, value.data());
  const auto number = finite_number(*node);
  if (!number) fail_value(key, "must be a finite number or a list of 3 finite numbers");
  value = PerAxis(*number);
}

void YamlSection::read(const std::string& key, std::vector<double>& value) {
  const auto* items = take_list(key, "must be a list of numbers");
  if (!items) return;
  value.resize(items->size());
  read_exactly(key, items->size(), value.data());
}

void YamlSection::read(const std::string& key, std::vector<Eigen::Vector2d>& value) {
  read_vectors(key, value);
}

void YamlSection::read(const std::string& key, std::vector<Eigen::Vector3d>& value) {
  read_vectors(key, value);
}

template <typename Vector>
void YamlSection::read_vectors(const std::string& key, std::vector<Vector>& value) {
  constexpr int count = Vector::RowsAtCompileTime;
  const std::string rule =
      "must be a list of lists of " + std::to_string(count) + " finite numbers";
  const auto* items = take_list(key, rule);
  if (!items) return;
  value.clear();
  for (const auto& item : *items) {
    if (item->kind != YamlNode::Kind::sequence || item->items.size() != std::size_t{count})
      fail(key, rule + ", got " + item->describe() + " in it");
    Vector& vector = value.emplace_back();
    for (int i = 0; i < count; ++i) {
      const YamlNode& coordinate = *item->items[static_cast<std::size_t>(i)];
      const auto number = finite_number(coordinate);
      if (!number) fail(key, rule + ", got " + coordinate.describe() + " in it");
      vector[i] = *number;
    }
  }
}

void YamlSection::read(const std::string& key, std::vector<std::string>& value) {
  const auto* items = take_list(key, "must be a list of texts");
  if (!items) return;
  value.clear();
  for (const auto& item : *items) {
    if (item->kind != YamlNode::Kind::scalar)
      fail(key, "must be a list of texts, got " + item->describe() + " in it");
    value.push_back(item->text);
  }
}

std::optional<std::size_t> YamlSection::choice(const std::string& key,
                                               const std::vector<std::string>& names) {
  const YamlNode* node = take(key);
  if (!node) return std::nullopt;
  const auto found = std::find(names.begin(), names.end(), node->text);
  if (node->kind != YamlNode::Kind::scalar || found == names.end())
    fail_value(key, "must be one of " + joined(names));
  return static_cast<std::size_t>(found - names.begin());
}

// The number is extended precision, so that every angle in radians has a text in degrees that reads
// back to it.
void YamlSection::read_angle(const std::string& key, double& value_rad, int limit_deg, char right) {
  const YamlNode* node = take(key);
  if (!node) return;
  const long double degrees = number_of<long double>(*node).value_or(-1);
  const bool is_below = right == ']' ? degrees <= limit_deg : degrees < limit_deg;
  if (!(degrees > 0 && is_below))
    fail_value(key, "must be in (0, " + std::to_string(limit_deg) + right);
  value_rad = radians(degrees);
}

void YamlSection::require_schema(const std::string& prefix, int newest) {
  std::string schema;
  need("schema", schema);
  int version = 0;
  const char* digits = schema.c_str() + std::min(prefix.size(), schema.size());
  const char* end = schema.c_str() + schema.size();
  const auto parsed = std::from_chars(digits, end, version);
  const bool is_schema = schema.compare(0, prefix.size(), prefix) == 0 &&
                         parsed.ec == std::errc() && parsed.ptr == end && version > 0;
  const std::string own = prefix + std::to_string(newest);
  if (!is_schema) fail_value("schema", "must be " + own);
  if (version > newest)
    fail_value("schema", "is newer than this library, which reads up to " + own);
}

YamlSection YamlSection::section(const std::string& key) {
  const YamlNode* node = take(key);
  if (!node) fail_missing(key);
  if (node->kind != YamlNode::Kind::mapping) fail_value(key, "must be a mapping of keys");
  const YamlNode::Entry* entry = node_->find(key);
  return {entry->value, entry->line, file_, path_.empty() ? key : path_ + "." + key};
}

std::vector<YamlSection> YamlSection::sections(const std::string& key) {
  const auto* items = take_list(key, "must be a list");
  if (!items) fail_missing(key);
  std::vector<YamlSection> made;
  for (const auto& item : *items) {
    const std::string path =
        (path_.empty() ? key : path_ + "." + key) + "[" + std::to_string(made.size()) + "]";
    if (item->kind != YamlNode::Kind::mapping)
      throw std::runtime_error(file_ + ":" + std::to_string(item->line) + ": key `" + path +
                               "`: must be a mapping of keys, got " + item->describe());
    made.emplace_back(item, item->line, file_, path);
  }
  return made;
}

void YamlSection::check(const std::function<void()>& check, const std::string& otherwise) const {
  try {
    check();
  } catch (const std::invalid_argument& error) {
    const std::string text = error.what();
    const std::size_t rule = text.find(" must be ");
    const std::string field = field_of(text.substr(0, rule));
    for (const std::string& key : {field, field + "_px", "image_" + field, field + "_coefficients"})
      if (has(key)) fail(key, text.substr(rule + 1));
    fail(otherwise, text);
  }
}

void YamlSection::reject_unknown() const {
  for (const YamlNode::Entry& entry : node_->entries)
    if (std::find(known_.begin(), known_.end(), entry.key) == known_.end())
      fail_unknown(entry, known_);
}

// A key in another unit explains why the right one is missing, so it is reported instead.
void YamlSection::fail_missing(const std::string& key) const {
  for (const YamlNode::Entry& entry : node_->entries)
    if (differ_in_unit(entry.key, key)) fail_unknown(entry, {key});
  fail(key, "is missing");
}

void YamlSection::fail_unknown(const YamlNode::Entry& entry,
                               const std::vector<std::string>& known) const {
  fail(entry.key,
       "is not known, got " + entry.value->describe() + "; " + suggest_key(entry.key, known));
}

void YamlSection::fail(const std::string& key, const std::string& reason) const {
  const YamlNode::Entry* entry = node_->find(key);
  std::string where = file_ + ":" + std::to_string(entry ? entry->line : line_) + ": ";
  const std::string full = path_ + (path_.empty() || key.empty() ? "" : ".") + printable(key);
  if (!full.empty()) where += "key `" + full + "`: ";
  throw std::runtime_error(where + reason);
}

void YamlSection::fail_value(const std::string& key, const std::string& rule) const {
  fail(key, rule + ", got " + node_->find(key)->value->describe());
}

}  // namespace occ::internal::core
