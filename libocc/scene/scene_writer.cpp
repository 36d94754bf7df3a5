// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <filesystem>
#include <string_view>

#include "libocc/core/internal/file.hpp"
#include "libocc/core/internal/yaml_fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/radiometry/emission_profile.hpp"
#include "libocc/scene/internal/camera_section.hpp"
#include "libocc/scene/internal/scene_fields.hpp"
#include "libocc/scene/scene_file.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::codes;
using namespace internal::radiometry;
using namespace internal::scene;
namespace {

void write_channels(const std::vector<Channel>& channels, std::string& out) {
  constexpr std::array<const char*, 3> colours{"red", "green", "blue"};
  out += "  channels:\n";
  for (std::size_t i = 0; i < channels.size(); ++i) {
    out += std::string("    ") + colours[i] + ":\n";
    Lines lines(out, "      ");
    write_fields(lines, channels[i], channel_fields);
  }
}

void write_sensor(const Sensor& sensor, std::string& out) {
  out += "sensor:\n";
  Lines lines(out, "  ");
  write_fields(lines, sensor, sensor_fields);
  if (!sensor.channels.empty()) write_channels(sensor.channels, out);
}

void write_lens(const Lens& lens, std::string& out) {
  out += "lens:\n";
  Lines lines(out, "  ");
  write_fields(lines, lens, lens_fields);
  if (!lens.ghosts.empty()) out += "  ghosts:\n";
  for (const Ghost& ghost : lens.ghosts) {
    Lines ghost_lines(out, "    - ");
    write_fields(ghost_lines, ghost, ghost_fields);
  }
}

template <typename Part, typename Fields>
void write_parts(const char* key, const std::vector<Part>& parts, const Fields& fields,
                 std::string& out) {
  if (!parts.empty()) out += std::string(key) + ":\n";
  for (const Part& part : parts) {
    Lines lines(out, "  - ");
    write_fields(lines, part, fields);
  }
}

void write_effects(const Effects& effects, std::string& out) {
  out += "effects:\n";
  Lines lines(out, "  ");
  for (std::size_t i = 0; i < effect_count; ++i)
    if (effects.use[i] != Use::on)
      lines.add(effect_name(static_cast<Effect>(i)), word(use_words, effects.use[i]));
  write_fields(lines, effects, effects_fields);
}

// Returns true when frequency_hz and waveform are those that the lamp's code sets.
bool follows_from_code(const Lamp& lamp) {
  if (!lamp.code) return false;
  Lamp coded = lamp;
  coded.set_code(*lamp.code);
  return coded.frequency_hz == lamp.frequency_hz && coded.waveform == lamp.waveform;
}

// Mapping in braces with the keys of LampCode and of its Code, `kind` first.
std::string code_text(const LampCode& lamp_code) {
  std::string code_keys;
  Lines lines(code_keys, "");
  write_fields(lines, lamp_code.code, code_fields);
  const std::size_t kind_end = code_keys.find('\n') + 1;
  std::string keys = code_keys.substr(0, kind_end);
  Lines(keys, "").add("id", lamp_code.id);
  Lines(keys, "").add("channel", lamp_code.channel);
  keys += code_keys.substr(kind_end);
  std::string text;
  for (const char c : keys) text += c == '\n' ? std::string(", ") : std::string(1, c);
  return "{" + text.substr(0, text.size() - 2) + "}";
}

// Mapping in braces with the file of the photometry: relative to `folder`, or with its absolute
// path if `folder` is empty, since the text may be read from another working directory.
std::string photometry_text(const Lamp& lamp, const std::filesystem::path& folder) {
  const std::string& file = lamp.photometry->distribution().file;
  if (file.empty())
    require(false, "lamp " + std::to_string(lamp.id) + ": photometry", "a distribution without",
            "from a file: a scene stores its name");
  std::filesystem::path path = std::filesystem::absolute(file).lexically_normal();
  if (!folder.empty()) path = path.lexically_proximate(folder);
  return "{file: " + quoted(path.string()) + "}";
}

void write_lamp(Lamp lamp, const std::filesystem::path& folder, std::string& out) {
  const bool coded = follows_from_code(lamp);
  if (coded) {  // the code replaces these two
    lamp.frequency_hz.reset();
    lamp.waveform.clear();
  }
  Lines lines(out, "  - ");
  write_fields(lines, lamp, lamp_fields, [&](const char* name) {
    if (coded && name == std::string_view("code")) lines.add(name, code_text(*lamp.code));
    if (lamp.photometry && name == std::string_view("photometry"))
      lines.add(name, photometry_text(lamp, folder));
  });
}

// folder: absolute path of the folder that files are named relative to, or empty.
std::string scene_text(const Scene& scene, const std::filesystem::path& folder) {
  Scene checked = scene;
  checked.validate();
  std::string out = "schema: libocc-scene/" + std::to_string(scene_schema_version) + "\n";
  write_camera_section(checked.camera, out);
  write_sensor(checked.sensor, out);
  out += checked.lamps.empty() ? "lamps: []\n" : "lamps:\n";
  for (const Lamp& lamp : checked.lamps) write_lamp(lamp, folder, out);
  if (checked.map_sigma_m) Lines(out, "").add("map_sigma_m", *checked.map_sigma_m);
  if (checked.map_scale_sigma > 0) Lines(out, "").add("map_scale_sigma", checked.map_scale_sigma);
  write_lens(checked.lens, out);
  Lines(out, "").add("ambient_w_m2", checked.ambient_w_m2);
  write_parts("boxes", checked.boxes, box_fields, out);
  write_parts("tags", checked.tags, tag_fields, out);
  if (checked.room) {
    out += "room:\n";
    Lines lines(out, "  ");
    write_fields(lines, *checked.room, room_fields);
  }
  write_effects(checked.effects, out);
  if (!checked.assumed.empty()) out += "assumed:\n";
  for (const std::string& sentence : checked.assumed) out += "  - " + quoted(sentence) + "\n";
  return out;
}

}  // namespace

std::string format_scene(const Scene& scene) { return scene_text(scene, {}); }

void write_scene(const std::string& path, const Scene& scene) {
  const std::filesystem::path folder =
      std::filesystem::absolute(path).lexically_normal().parent_path();
  const std::string text = scene_text(scene, folder);
  write_file(path, text.data(), text.size());
}

}  // namespace occ
