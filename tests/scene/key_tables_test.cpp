// SPDX-License-Identifier: Apache-2.0
// The key tables of data/scenes/README.md and data/objects/README.md agree with the lists of
// fields.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <string>

#include "libocc/core/internal/yaml_fields.hpp"
#include "libocc/scene/internal/scene_fields.hpp"

namespace occ {

using namespace internal::codes;
using namespace internal::core;
using namespace internal::radiometry;
using namespace internal::scene;
namespace {

/// The default as the table shows it: lists and words in backquotes, "none" for what files omit.
template <class T, class Rule>
std::string default_text(const T& value, const Rule& rule) {
  if (is_left_out(value, rule)) return "none";
  const std::string text = value_text(value, rule);
  if constexpr (std::is_same_v<T, int> || std::is_same_v<T, double>) return text;
  if constexpr (std::is_same_v<T, std::string>) return "`" + value + "`";
  return "`" + text + "`";
}

/// "| `key` | unit | default | help (rule) |"; the key is bold when it is required.
template <class C, class F>
std::string table_row(const F& field) {
  const C defaults{};
  const auto& value = field.access(defaults);
  const std::string key = "`" + file_key(field.name, field.rule) + "`";
  const bool in_degrees = std::is_same_v<decltype(F::rule), Angle>;
  std::string row = "| " + (field.needed_in_files ? "**" + key + "**" : key) + " | ";
  const std::string unit = in_degrees ? "deg" : field.unit;
  row += unit.empty() ? "| " : unit + " | ";
  if (!field.needed_in_files) row += default_text(value, field.rule) + " ";
  row += std::string("| ") + field.help;
  if constexpr (std::is_same_v<decltype(F::rule), Interval>)
    row += " (" + field.rule.text(value) + ")";
  if constexpr (std::is_same_v<decltype(F::rule), Angle>)
    row += " (in (0, " + std::to_string(field.rule.limit_deg) + field.rule.right + ")";
  return row + " |";
}

std::string text_of_file(const std::string& name) {
  std::ifstream file(std::string(LIBOCC_DATA) + name);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// The tables of one README.
class KeyTables {
 public:
  explicit KeyTables(const std::string& name) : readme_(text_of_file(name)) {}

  /// Expects the rows of all fields, in order, below a heading; fields marked ByHand have separate
  /// rows.
  template <class C, class... Fields>
  void expect_table(const std::string& heading, const std::tuple<Fields...>& fields) const {
    std::size_t from = readme_.find("\n### " + heading);
    ASSERT_NE(from, std::string::npos) << heading;
    const std::size_t end = readme_.find("\n#", from + 2);
    for_each_field(fields, [&](const auto& field) {
      if constexpr (!std::is_same_v<std::decay_t<decltype(field.rule)>, ByHand>) {
        const std::string row = table_row<C>(field);
        const std::size_t at = readme_.find("\n" + row + "\n", from);
        EXPECT_LT(at, end) << heading << ": the row should be\n" << row;
        if (at < end) from = at;
      }
    });
  }

 private:
  std::string readme_;
};

TEST(KeyTables, ScenesAgreeWithTheFields) {
  const KeyTables scenes("/scenes/README.md");
  scenes.expect_table<Sensor>("`sensor`", sensor_fields);
  scenes.expect_table<Channel>("`channels`", channel_fields);
  scenes.expect_table<Lamp>("`lamps`", lamp_fields);
  scenes.expect_table<Code>("`code`", code_fields);
  scenes.expect_table<Lens>("`lens`", lens_fields);
  scenes.expect_table<Ghost>("`ghosts`", ghost_fields);
  scenes.expect_table<Room>("`room`", room_fields);
  scenes.expect_table<Box>("`boxes`", box_fields);
  scenes.expect_table<Tag>("`tags`", tag_fields);
  scenes.expect_table<Effects>("`effects`", effects_fields);
}

TEST(KeyTables, ObjectsAgreeWithTheFields) {
  KeyTables("/objects/README.md").expect_table<ObjectPoint>("`points`", object_point_fields);
}

}  // namespace
}  // namespace occ
