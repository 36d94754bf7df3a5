// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <stdexcept>

#include "libocc/core/internal/file.hpp"
#include "libocc/scene/internal/camera_reader.hpp"
#include "libocc/scene/internal/words.hpp"
#include "libocc/scene/internal/yaml_lines.hpp"
#include "libocc/scene/scene_file.hpp"

namespace occ {

using namespace internal::core;
using namespace internal::scene;
namespace {

template <typename T>
std::string word(const YamlSection::Words<T>& words, T value) {
  for (const auto& [name, meaning] : words)
    if (meaning == value) return name;
  throw std::invalid_argument("scene: an enumerator without a name");
}

void write_channels(const std::vector<Channel>& channels, std::string& out) {
  constexpr std::array<const char*, 3> colours{"red", "green", "blue"};
  out += "  channels:\n";
  for (std::size_t i = 0; i < channels.size(); ++i) {
    out += std::string("    ") + colours[i] + ":\n";
    Lines lines(out, "      ");
    lines.add("efficiency", channels[i].efficiency);
    lines.add("response", word(response_words(), channels[i].response));
    lines.add("gamma", channels[i].gamma);
    if (!channels[i].response_table.empty())
      lines.add("response_table", list_text(channels[i].response_table));
  }
}

void write_sensor(const Sensor& sensor, std::string& out) {
  out += "sensor:\n";
  Lines lines(out, "  ");
  lines.add("pixel_pitch_m", sensor.pixel_pitch_m);
  lines.add("f_number", sensor.f_number);
  lines.add("exposure_s", sensor.exposure_s);
  lines.add("quantum_efficiency", sensor.quantum_efficiency);
  lines.add("wavelength_m", sensor.wavelength_m);
  lines.add("full_well_e", sensor.full_well_e);
  lines.add("gain_dn_per_e", sensor.gain_dn_per_e);
  lines.add("read_noise_e", sensor.read_noise_e);
  lines.add("dark_current_e_per_s", sensor.dark_current_e_per_s);
  lines.add("black_level_dn", sensor.black_level_dn);
  lines.add("bit_depth", sensor.bit_depth);
  lines.add("response", word(response_words(), sensor.response));
  lines.add("gamma", sensor.gamma);
  if (!sensor.response_table.empty()) lines.add("response_table", list_text(sensor.response_table));
  lines.add("row_time_s", sensor.row_time_s);
  lines.add("readout", word(readout_words(), sensor.readout));
  lines.add("psf_sigma_px", sensor.psf_sigma_px);
  lines.add("gain_sigma", sensor.gain_sigma);
  lines.add("gain_seed", sensor.gain_seed);
  lines.add("blooming", sensor.blooming);
  lines.add("mosaic", word(mosaic_words(), sensor.mosaic));
  if (!sensor.channels.empty()) write_channels(sensor.channels, out);
}

void write_lens(const Lens& lens, std::string& out) {
  out += "lens:\n";
  Lines lines(out, "  ");
  lines.add("diffraction", std::string(lens.diffraction ? "true" : "false"));
  if (lens.focus_distance_m) lines.add("focus_distance_m", *lens.focus_distance_m);
  lines.add("vignetting", list_text(lens.vignetting));
  lines.add("veiling_glare", lens.veiling_glare);
  if (!lens.ghosts.empty()) out += "  ghosts:\n";
  for (const Ghost& ghost : lens.ghosts) {
    Lines of_ghost(out, "    - ");
    of_ghost.add("strength", ghost.strength);
    of_ghost.add("scale", ghost.scale);
    of_ghost.add("blur_px", ghost.blur_px);
  }
}

void write_boxes(const std::vector<Box>& boxes, std::string& out) {
  if (!boxes.empty()) out += "boxes:\n";
  for (const Box& box : boxes) {
    Lines lines(out, "  - ");
    lines.add("min_m", box.min_m);
    lines.add("max_m", box.max_m);
  }
}

void write_tags(const std::vector<Tag>& tags, std::string& out) {
  if (!tags.empty()) out += "tags:\n";
  for (const Tag& tag : tags) {
    Lines lines(out, "  - ");
    lines.add("id", tag.id);
    lines.add("family", quoted(tag.family));
    lines.add("size_m", tag.size_m);
    lines.add("centre_m", tag.centre_m);
    lines.add("normal", tag.normal);
    lines.add("x_axis", tag.x_axis);
  }
}

void write_effects(const Effects& effects, std::string& out) {
  out += "effects:\n";
  Lines lines(out, "  ");
  for (std::size_t i = 0; i < effect_count; ++i)
    if (effects.use[i] != Use::on)
      lines.add(effect_name(static_cast<Effect>(i)), word(use_words(), effects.use[i]));
  lines.add("tolerance_dn", effects.tolerance_dn);
  lines.add("tolerance_px", effects.tolerance_px);
}

/// Whether a lamp's code says all of its light.
bool shines_as_coded(const Lamp& lamp) {
  if (!lamp.code) return false;
  Lamp coded = lamp;
  coded.set_code(*lamp.code);
  return coded.frequency_hz == lamp.frequency_hz && coded.waveform == lamp.waveform;
}

std::string code_text(const LampCode& said) {
  const Code& code = said.code;
  return "{kind: " + word(code_kind_words(), code.kind) + ", id: " + std::to_string(said.id) +
         ", channel: " + std::to_string(said.channel) +
         ", id_bits: " + std::to_string(code.id_bits) +
         ", checksum: " + word(checksum_words(), code.checksum) +
         ", clock_hz: " + text_of(code.clock_hz) + ", line: " + word(line_code_words(), code.line) +
         ", repeats: " + std::to_string(code.repeats) +
         ", frame_rate_hz: " + text_of(code.frame_rate_hz) + ", min_hz: " + text_of(code.min_hz) +
         "}";
}

void write_blinking(const Lamp& lamp, Lines& lines) {
  if (shines_as_coded(lamp)) {
    lines.add("code", code_text(*lamp.code));
  } else {
    if (lamp.frequency_hz) lines.add("frequency_hz", *lamp.frequency_hz);
    if (!lamp.waveform.empty()) lines.add("waveform", list_text(lamp.waveform));
  }
  lines.add("duty", lamp.duty);
  lines.add("phase", lamp.phase);
}

void write_lamp(const Lamp& lamp, std::string& out) {
  Lines lines(out, "  - ");
  lines.add("id", lamp.id);
  if (!lamp.name.empty()) lines.add("name", quoted(lamp.name));
  lines.add("shape", word(shape_words(), lamp.shape));
  lines.add("centre_m", lamp.centre_m);
  lines.add("normal", lamp.normal);
  if (lamp.shape == LampShape::disc) lines.add("radius_m", lamp.radius_m);
  if (lamp.shape == LampShape::rectangle || lamp.shape == LampShape::lame) {
    lines.add("size_m", list_text(lamp.size_m));
    lines.add("x_axis", lamp.x_axis);
  }
  if (lamp.shape == LampShape::lame) lines.add("exponent", lamp.exponent);
  lines.add("power_w", lamp.power_w);
  lines.add("power_sigma", lamp.power_sigma);
  lines.add("half_power_deg", degrees_text(lamp.half_power_rad));
  write_blinking(lamp, lines);
  lines.add("colour", lamp.colour);
}

}  // namespace

std::string format_scene(const Scene& scene) {
  Scene checked = scene;
  checked.validate();
  std::string out =
      "schema: " + std::string(schema_prefix) + std::to_string(scene_schema_version) + "\n";
  write_camera_section(checked.camera, out);
  write_sensor(checked.sensor, out);
  out += checked.lamps.empty() ? "lamps: []\n" : "lamps:\n";
  for (const Lamp& lamp : checked.lamps) write_lamp(lamp, out);
  write_lens(checked.lens, out);
  Lines(out, "").add("ambient_w_m2", checked.ambient_w_m2);
  write_boxes(checked.boxes, out);
  write_tags(checked.tags, out);
  if (checked.room) {
    out += "room:\n";
    Lines lines(out, "  ");
    lines.add("size_m", checked.room->size_m);
    lines.add("wall_reflectance", checked.room->wall_reflectance);
  }
  write_effects(checked.effects, out);
  if (!checked.assumed.empty()) out += "assumed:\n";
  for (const std::string& sentence : checked.assumed) out += "  - " + quoted(sentence) + "\n";
  return out;
}

void write_scene(const std::string& path, const Scene& scene) {
  const std::string text = format_scene(scene);
  write_file(path, text.data(), text.size());
}

}  // namespace occ
