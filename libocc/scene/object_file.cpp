// SPDX-License-Identifier: Apache-2.0
#include <map>

#include "libocc/core/internal/file.hpp"
#include "libocc/core/internal/yaml_fields.hpp"
#include "libocc/scene/internal/scene_fields.hpp"
#include "libocc/scene/object.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

Object read_root(const std::shared_ptr<const YamlNode>& node, const std::string& file) {
  YamlSection root(node, node->line, file, "");
  root.require_schema("libocc-object/", object_schema_version);
  Object object;
  root.need("name", object.name);
  std::map<int, std::size_t> ids;
  for (YamlSection& section : root.sections("points")) {
    read_fields(section, object.points.emplace_back(), object_point_fields);
    section.reject_unknown();
    section.check([&] { Object{"any", {object.points.back()}}.validate(); });
    const auto [first, is_new] = ids.emplace(object.points.back().id, object.points.size() - 1);
    if (!is_new)
      section.fail_value(
          "id", "must be unique, points[" + std::to_string(first->second) + "] has the same");
  }
  root.reject_unknown();
  root.check([&] { object.validate(); });
  return object;
}

}  // namespace

Object read_object(const std::string& path) { return read_root(read_yaml(path), path); }

Object parse_object(const std::string& text, const std::string& name) {
  return read_root(parse_yaml(text, name), name);
}

std::string format_object(const Object& object) {
  Object checked = object;
  checked.validate();
  std::string out = "schema: libocc-object/" + std::to_string(object_schema_version) + "\n";
  Lines(out, "").add("name", internal::core::quoted(checked.name));
  out += "points:\n";
  for (const ObjectPoint& point : checked.points) {
    Lines lines(out, "  - ");
    write_fields(lines, point, object_point_fields);
  }
  return out;
}

void write_object(const std::string& path, const Object& object) {
  const std::string text = format_object(object);
  write_file(path, text.data(), text.size());
}

}  // namespace occ
