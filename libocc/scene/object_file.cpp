// SPDX-License-Identifier: Apache-2.0
#include <map>

#include "libocc/core/internal/file.hpp"
#include "libocc/scene/internal/schema.hpp"
#include "libocc/scene/internal/yaml_lines.hpp"
#include "libocc/scene/internal/yaml_section.hpp"
#include "libocc/scene/object.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

constexpr char object_prefix[] = "libocc-object/";

ObjectPoint read_point(YamlSection& section) {
  ObjectPoint point;
  section.need("id", point.id);
  section.read("label", point.label);
  section.need("position_m", point.position_m);
  section.read("normal", point.normal);
  section.read_cone("cone_deg", point.cone_rad);
  section.read("radius_m", point.radius_m);
  section.refuse_unknown();
  return point;
}

Object read_root(const std::shared_ptr<const YamlNode>& node, const std::string& file) {
  YamlSection root(node, node->line, file, "");
  refuse_other_schema(root, object_prefix, object_schema_version);
  Object object;
  root.need("name", object.name);
  std::map<int, std::size_t> ids;
  for (YamlSection& section : root.sections("points")) {
    object.points.push_back(read_point(section));
    section.check([&] { Object{"any", {object.points.back()}}.validate(); });
    const auto [first, is_new] = ids.emplace(object.points.back().id, object.points.size() - 1);
    if (!is_new)
      section.fail_value("id", "must be of one point only, points[" +
                                   std::to_string(first->second) + "] has it too");
  }
  root.refuse_unknown();
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
  std::string out =
      "schema: " + std::string(object_prefix) + std::to_string(object_schema_version) + "\n";
  Lines(out, "").add("name", quoted(checked.name));
  out += "points:\n";
  for (const ObjectPoint& point : checked.points) {
    Lines lines(out, "  - ");
    lines.add("id", point.id);
    if (!point.label.empty()) lines.add("label", quoted(point.label));
    lines.add("position_m", point.position_m);
    lines.add("normal", point.normal);
    lines.add("cone_deg", degrees_text(point.cone_rad));
    lines.add("radius_m", point.radius_m);
  }
  return out;
}

void write_object(const std::string& path, const Object& object) {
  const std::string text = format_object(object);
  write_file(path, text.data(), text.size());
}

}  // namespace occ
