// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>

#include "libocc/core/internal/yaml_fields.hpp"
#include "libocc/radiometry/emission_profile.hpp"
#include "libocc/radiometry/response_basis.hpp"
#include "libocc/scene/internal/camera_section.hpp"
#include "libocc/scene/internal/scene_fields.hpp"
#include "libocc/scene/scene_file.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::codes;
using namespace internal::radiometry;
using namespace internal::scene;
namespace {

// Profiles by the path of their file. Lamps of one kind share the profile.
using Profiles = std::map<std::string, std::shared_ptr<const EmissionProfile>>;

// Reads the key `response_coefficients`, which is no field: it gives the response table of a sensor
// or channel as coefficients of the basis of response curves (radiometry/response_basis.hpp).
template <typename Curve>
void read_response_coefficients(YamlSection& section, Curve& curve) {
  std::vector<double> coefficients;
  section.read("response_coefficients", coefficients);
  if (!section.has("response_coefficients")) return;
  if (section.has("response") || section.has("response_table"))
    section.fail("response_coefficients",
                 "must not be given together with `response` or `response_table`");
  section.check([&] { curve.response_table = response_curve(coefficients, 256); });
  curve.response = Response::table;
}

void read_channels(YamlSection section, Sensor& sensor) {
  for (const char* colour : {"red", "green", "blue"}) {
    if (!section.has(colour)) section.fail_missing(colour);
    YamlSection part = section.section(colour);
    Channel& channel = sensor.channels.emplace_back();
    read_fields(part, channel, channel_fields);
    read_response_coefficients(part, channel);
    part.reject_unknown();
  }
  section.reject_unknown();
}

Sensor read_sensor(YamlSection section) {
  Sensor sensor;
  read_fields(section, sensor, sensor_fields);
  read_response_coefficients(section, sensor);
  if (section.has("channels")) read_channels(section.section("channels"), sensor);
  section.reject_unknown();
  section.check([&] { sensor.validate(); });
  return sensor;
}

// Reads the mapping `code`, which holds the fields of LampCode and of its Code. The id defaults to
// that of the lamp.
void read_code(YamlSection section, Lamp& lamp) {
  LampCode lamp_code;
  lamp_code.id = lamp.id;
  read_fields(section, lamp_code.code, code_fields);
  section.read("id", lamp_code.id);
  section.read("channel", lamp_code.channel);
  section.reject_unknown();
  section.check([&] { lamp.set_code(lamp_code); });
}

// Reads the key `photometry`, a file name or a mapping {file: NAME}, relative to the scene's
// folder. A lamp without shape and radius takes the shape of the luminous opening.
void read_photometry_key(YamlSection& section, Profiles& profiles, Lamp& lamp) {
  if (section.has("half_power_deg"))
    section.fail("half_power_deg", "must not be given together with `photometry`");
  std::string file;
  if (section.is_mapping("photometry")) {
    YamlSection part = section.section("photometry");
    part.need("file", file);
    part.reject_unknown();
  } else {
    section.read("photometry", file);
  }
  const std::string path =
      (std::filesystem::path(section.file()).parent_path() / file).lexically_normal().string();
  std::shared_ptr<const EmissionProfile>& profile = profiles[path];
  try {
    if (!profile) profile = std::make_shared<const EmissionProfile>(read_photometry(path));
    if (section.has("shape") || section.has("radius_m"))
      lamp.photometry = profile;
    else
      lamp.set_photometry(profile);
  } catch (const std::runtime_error& error) {
    section.fail("photometry", error.what());
  } catch (const std::invalid_argument& error) {
    section.fail("photometry", path + ": " + error.what());
  }
}

// True for a size that validate() takes from the luminous opening.
bool is_size_of_opening(const Lamp& lamp, const std::string& name) {
  if (!lamp.photometry) return false;
  Lamp opening;
  if (lamp.photometry->distribution().opening != OpeningShape::sideways)
    opening.set_photometry(lamp.photometry);
  if (name == "radius_m") return opening.radius_m > 0;
  return (name == "size_m" || name == "exponent") && opening.shape == lamp.shape;
}

Lamp read_lamp(YamlSection section, Profiles& profiles) {
  Lamp lamp;
  if (section.has("photometry")) read_photometry_key(section, profiles, lamp);
  for (const char* key : {"frequency_hz", "waveform"})
    if (section.has("code") && section.has(key))
      section.fail(key, "must not be given together with `code`, which sets it");
  read_fields(section, lamp, lamp_fields,
              [&](const char* name) { return is_size_of_opening(lamp, name); });
  if (section.has("code")) read_code(section.section("code"), lamp);
  section.reject_unknown();
  section.check([&] { lamp.validate(); });
  return lamp;
}

std::vector<Lamp> read_lamps(YamlSection& root) {
  std::vector<Lamp> lamps;
  std::map<int, std::size_t> index_of;
  Profiles profiles;
  for (const YamlSection& section : root.sections("lamps")) {
    lamps.push_back(read_lamp(section, profiles));
    const auto [first, is_new] = index_of.emplace(lamps.back().id, lamps.size() - 1);
    if (!is_new)
      section.fail_value(
          "id", "must be unique, lamps[" + std::to_string(first->second) + "] has the same");
  }
  return lamps;
}

Lens read_lens(YamlSection section) {
  Lens lens;
  read_fields(section, lens, lens_fields);
  if (section.has("ghosts"))
    for (YamlSection& part : section.sections("ghosts")) {
      read_fields(part, lens.ghosts.emplace_back(), ghost_fields);
      part.reject_unknown();
    }
  section.reject_unknown();
  section.check([&] { lens.validate(); });
  return lens;
}

// Reads a list of parts of a scene. The scene is valid before a part is added, so any error of
// validate() is an error of that part.
template <typename Part, typename Fields>
void read_parts(YamlSection& root, const char* key, std::vector<Part>& parts, const Fields& fields,
                Scene& scene) {
  if (!root.has(key)) return;
  for (YamlSection& section : root.sections(key)) {
    read_fields(section, parts.emplace_back(), fields);
    section.reject_unknown();
    section.check([&] { scene.validate(); });
  }
}

void read_room(YamlSection section, Scene& scene) {
  read_fields(section, scene.room.emplace(), room_fields);
  section.reject_unknown();
  section.check([&] { scene.validate(); });
}

// Reads the section `effects`: one key for each effect, and `default` for the effects not listed.
Effects read_effects(YamlSection section) {
  Effects effects;
  Use standard = Use::on;
  section.read("default", standard, use_words);
  effects.use.fill(standard);
  for (std::size_t i = 0; i < effect_count; ++i)
    section.read(effect_name(static_cast<Effect>(i)), effects.use[i], use_words);
  read_fields(section, effects, effects_fields);
  section.reject_unknown();
  section.check([&] { effects.validate(); });
  return effects;
}

Scene read_scene_root(const std::shared_ptr<const YamlNode>& node, const std::string& name,
                      const std::optional<Camera>& camera) {
  YamlSection root(node, node->line, name, "");
  root.require_schema("libocc-scene/", scene_schema_version);
  Scene scene;
  if (camera && root.has("camera")) root.section("camera");  // known, but not read
  scene.camera = camera ? *camera : read_camera_section(root);
  if (root.has("sensor")) scene.sensor = read_sensor(root.section("sensor"));
  scene.lamps = read_lamps(root);
  if (root.has("lens")) scene.lens = read_lens(root.section("lens"));
  root.read("map_sigma_m", scene.map_sigma_m);
  root.read("map_scale_sigma", scene.map_scale_sigma);
  root.read("ambient_w_m2", scene.ambient_w_m2);
  root.check([&] { scene.validate(); });
  read_parts(root, "boxes", scene.boxes, box_fields, scene);
  read_parts(root, "tags", scene.tags, tag_fields, scene);
  if (root.has("room")) read_room(root.section("room"), scene);
  if (root.has("effects")) scene.effects = read_effects(root.section("effects"));
  root.read("assumed", scene.assumed);
  root.reject_unknown();
  return scene;
}

}  // namespace

Scene read_scene(const std::string& path, const std::optional<Camera>& camera) {
  return read_scene_root(read_yaml(path), path, camera);
}

Scene parse_scene(const std::string& text, const std::string& name) {
  return read_scene_root(parse_yaml(text, name), name, std::nullopt);
}

}  // namespace occ
