// SPDX-License-Identifier: Apache-2.0
#include <map>

#include "libocc/radiometry/response_basis.hpp"
#include "libocc/scene/internal/camera_reader.hpp"
#include "libocc/scene/internal/schema.hpp"
#include "libocc/scene/internal/words.hpp"
#include "libocc/scene/internal/yaml_section.hpp"
#include "libocc/scene/scene_file.hpp"

namespace occ {

using namespace internal::scene;
namespace {

template <typename Curve>
void read_response(YamlSection& section, Curve& curve) {
  section.read("response", curve.response, response_words());
  section.read("gamma", curve.gamma);
  section.read("response_table", curve.response_table);
  std::vector<double> coefficients;
  section.read("response_coefficients", coefficients);
  if (!section.has("response_coefficients")) return;
  if (section.has("response") || section.has("response_table"))
    section.fail("response_coefficients", "must be alone, without response and response_table");
  section.check([&] { curve.response_table = response_curve(coefficients, 256); });
  curve.response = Response::table;
}

Channel read_channel(YamlSection section) {
  Channel channel;
  section.read("efficiency", channel.efficiency);
  read_response(section, channel);
  section.refuse_unknown();
  return channel;
}

void read_channels(YamlSection section, Sensor& sensor) {
  for (const char* colour : {"red", "green", "blue"}) {
    if (!section.has(colour)) section.fail_missing(colour);
    sensor.channels.push_back(read_channel(section.section(colour)));
  }
  section.refuse_unknown();
}

Sensor read_sensor(YamlSection section) {
  Sensor sensor;
  section.read("pixel_pitch_m", sensor.pixel_pitch_m);
  section.read("f_number", sensor.f_number);
  section.read("exposure_s", sensor.exposure_s);
  section.read("quantum_efficiency", sensor.quantum_efficiency);
  section.read("wavelength_m", sensor.wavelength_m);
  section.read("full_well_e", sensor.full_well_e);
  section.read("gain_dn_per_e", sensor.gain_dn_per_e);
  section.read("read_noise_e", sensor.read_noise_e);
  section.read("dark_current_e_per_s", sensor.dark_current_e_per_s);
  section.read("black_level_dn", sensor.black_level_dn);
  section.read("bit_depth", sensor.bit_depth);
  read_response(section, sensor);
  section.read("row_time_s", sensor.row_time_s);
  section.read("readout", sensor.readout, readout_words());
  section.read("psf_sigma_px", sensor.psf_sigma_px);
  section.read("gain_sigma", sensor.gain_sigma);
  section.read("gain_seed", sensor.gain_seed);
  section.read("blooming", sensor.blooming);
  section.read("mosaic", sensor.mosaic, mosaic_words());
  if (section.has("channels")) read_channels(section.section("channels"), sensor);
  section.refuse_unknown();
  section.check([&] { sensor.validate(); });
  return sensor;
}

// Keys of a shape are known for that shape alone: a disc with `size_m` is a mistake.
void read_shape(YamlSection& section, Lamp& lamp) {
  section.read("shape", lamp.shape, shape_words());
  if (lamp.shape == LampShape::disc) section.need("radius_m", lamp.radius_m);
  if (lamp.shape == LampShape::rectangle || lamp.shape == LampShape::lame) {
    section.need("size_m", lamp.size_m);
    section.read("x_axis", lamp.x_axis);
  }
  if (lamp.shape == LampShape::lame) section.need("exponent", lamp.exponent);
}

void read_code(YamlSection section, Lamp& lamp) {
  LampCode said;
  said.id = lamp.id;
  if (!section.has("kind")) section.fail_missing("kind");
  section.read("kind", said.code.kind, code_kind_words());
  section.read("id", said.id);
  section.read("channel", said.channel);
  section.read("id_bits", said.code.id_bits);
  section.read("checksum", said.code.checksum, checksum_words());
  section.read("clock_hz", said.code.clock_hz);
  section.read("line", said.code.line, line_code_words());
  section.read("repeats", said.code.repeats);
  section.read("frame_rate_hz", said.code.frame_rate_hz);
  section.read("min_hz", said.code.min_hz);
  section.refuse_unknown();
  section.check([&] { lamp.set_code(said); });
}

Lamp read_lamp(YamlSection section) {
  Lamp lamp;
  section.need("id", lamp.id);
  section.read("name", lamp.name);
  section.need("centre_m", lamp.centre_m);
  section.read("normal", lamp.normal);
  section.read("power_w", lamp.power_w);
  section.read("power_sigma", lamp.power_sigma);
  section.read_half_angle("half_power_deg", lamp.half_power_rad);
  if (section.has("code")) read_code(section.section("code"), lamp);
  for (const char* key : {"frequency_hz", "waveform"})
    if (lamp.code && section.has(key))
      section.fail(key, "must not be beside `code`, which sets it");
  section.read("frequency_hz", lamp.frequency_hz);
  section.read("duty", lamp.duty);
  section.read("waveform", lamp.waveform);
  section.read("phase", lamp.phase);
  section.read("colour", lamp.colour);
  read_shape(section, lamp);
  section.refuse_unknown();
  section.check([&] { lamp.validate(); });
  return lamp;
}

std::vector<Lamp> read_lamps(YamlSection& root) {
  std::vector<Lamp> lamps;
  std::map<int, std::size_t> index_of;
  for (const YamlSection& section : root.sections("lamps")) {
    lamps.push_back(read_lamp(section));
    const auto [first, is_new] = index_of.emplace(lamps.back().id, lamps.size() - 1);
    if (!is_new)
      section.fail_value("id", "must be of one lamp only, lamps[" + std::to_string(first->second) +
                                   "] has it too");
  }
  return lamps;
}

void read_room(YamlSection section, Scene& scene) {
  Room& room = scene.room.emplace();
  section.read("size_m", room.size_m);
  section.read("wall_reflectance", room.wall_reflectance);
  section.refuse_unknown();
  section.check([&] { scene.validate(); });  // every other part has been checked before
}

Lens read_lens(YamlSection section) {
  Lens lens;
  enum class Answer { no, yes } diffraction = Answer::no;
  section.read("diffraction", diffraction,
               YamlSection::Words<Answer>{{"false", Answer::no}, {"true", Answer::yes}});
  lens.diffraction = diffraction == Answer::yes;
  section.read("focus_distance_m", lens.focus_distance_m);
  section.read("vignetting", lens.vignetting);
  section.read("veiling_glare", lens.veiling_glare);
  if (section.has("ghosts"))
    for (YamlSection& part : section.sections("ghosts")) {
      Ghost& ghost = lens.ghosts.emplace_back();
      part.need("strength", ghost.strength);
      part.read("scale", ghost.scale);
      part.read("blur_px", ghost.blur_px);
      part.refuse_unknown();
    }
  section.refuse_unknown();
  section.check([&] { lens.validate(); });
  return lens;
}

void read_boxes(YamlSection& root, Scene& scene) {
  for (YamlSection& section : root.sections("boxes")) {
    Box& box = scene.boxes.emplace_back();
    section.need("min_m", box.min_m);
    section.need("max_m", box.max_m);
    section.refuse_unknown();
    section.check([&] { scene.validate(); });
  }
}

Effects read_effects(YamlSection section) {
  Effects effects;
  Use standard = Use::on;
  section.read("default", standard, use_words());
  effects.use.fill(standard);
  for (Use& use : effects.use) {
    const auto effect = static_cast<Effect>(&use - effects.use.data());
    section.read(effect_name(effect), use, use_words());
  }
  section.read("tolerance_dn", effects.tolerance_dn);
  section.read("tolerance_px", effects.tolerance_px);
  section.refuse_unknown();
  section.check([&] { effects.validate(); });
  return effects;
}

void read_tags(YamlSection& root, Scene& scene) {
  for (YamlSection& section : root.sections("tags")) {
    Tag& tag = scene.tags.emplace_back();
    section.need("id", tag.id);
    section.read("family", tag.family);
    section.need("size_m", tag.size_m);
    section.need("centre_m", tag.centre_m);
    section.read("normal", tag.normal);
    section.read("x_axis", tag.x_axis);
    section.refuse_unknown();
    section.check([&] { scene.validate(); });
  }
}

Scene read_root(const std::shared_ptr<const YamlNode>& node, const std::string& name) {
  YamlSection root(node, node->line, name, "");
  refuse_other_schema(root, schema_prefix, scene_schema_version);
  Scene scene;
  scene.camera = read_camera_section(root);
  if (root.has("sensor")) scene.sensor = read_sensor(root.section("sensor"));
  scene.lamps = read_lamps(root);
  if (root.has("lens")) scene.lens = read_lens(root.section("lens"));
  root.read("ambient_w_m2", scene.ambient_w_m2);
  root.check([&] { scene.validate(); });
  if (root.has("boxes")) read_boxes(root, scene);
  if (root.has("tags")) read_tags(root, scene);
  if (root.has("room")) read_room(root.section("room"), scene);
  if (root.has("effects")) scene.effects = read_effects(root.section("effects"));
  root.read("assumed", scene.assumed);
  root.refuse_unknown();
  return scene;
}

}  // namespace

Scene read_scene(const std::string& path) { return read_root(read_yaml(path), path); }

Scene parse_scene(const std::string& text, const std::string& name) {
  return read_root(parse_yaml(text, name), name);
}

}  // namespace occ
