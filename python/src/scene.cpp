// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/scene.hpp"

#include <pybind11/stl/filesystem.h>
#include <pybind11/typing.h>

#include "fields.hpp"
#include "libocc/scene/prior.hpp"
#include "libocc/scene/scene_file.hpp"
#include "module.hpp"

namespace occ::python {
namespace {

auto sensor_fields() {
  return std::make_tuple(
      field("pixel_pitch_m", &Sensor::pixel_pitch_m, "pixel pitch [m]"),
      field("f_number", &Sensor::f_number, "focal length over aperture"),
      field("exposure_s", &Sensor::exposure_s, "exposure time [s]"),
      field("quantum_efficiency", &Sensor::quantum_efficiency, "electrons per photon"),
      field("wavelength_m", &Sensor::wavelength_m, "at which it holds [m]"),
      field("full_well_e", &Sensor::full_well_e, "electrons a pixel can hold"),
      field("gain_dn_per_e", &Sensor::gain_dn_per_e, "grey levels per electron"),
      field("read_noise_e", &Sensor::read_noise_e, "standard deviation of reading [electrons]"),
      field("dark_current_e_per_s", &Sensor::dark_current_e_per_s, "[electrons/s]"),
      field("black_level_dn", &Sensor::black_level_dn, "grey level without light"),
      field("bit_depth", &Sensor::bit_depth, "8 to 16; more than 8 makes uint16 images"),
      field("response", &Sensor::response, "linear, gamma, srgb or table"),
      field("gamma", &Sensor::gamma, "of Response.gamma: stored = linear^(1/gamma)"),
      field("response_table", &Sensor::response_table,
            "of Response.table: stored values (0..1) at evenly spaced linear ones"),
      field("row_time_s", &Sensor::row_time_s, "from one row to the next [s]; 0: global shutter"),
      field("readout", &Sensor::readout, "pixels a rolling shutter exposes together"),
      field("psf_sigma_px", &Sensor::psf_sigma_px, "Gaussian blur of the lens [px]"),
      field("gain_sigma", &Sensor::gain_sigma, "relative standard deviation of the pixels' gains"),
      field("gain_seed", &Sensor::gain_seed, "sensors of one seed have the same pixels"),
      field("blooming", &Sensor::blooming,
            "part of the charge beyond the full well that spills along the column"),
      field("mosaic", &Sensor::mosaic, "colour filters over the pixels"),
      field("channels", &Sensor::channels, "Channels for red, green, blue; empty: all alike"));
}

auto channel_fields() {
  return std::make_tuple(
      field("efficiency", &Channel::efficiency, "times the sensor's quantum_efficiency"),
      field("response", &Channel::response, "linear, gamma, srgb or table"),
      field("gamma", &Channel::gamma, "of Response.gamma"),
      field("response_table", &Channel::response_table, "of Response.table"));
}

auto lens_fields() {
  return std::make_tuple(
      field("diffraction", &Lens::diffraction, "blur of 0.42 wavelength x f-number"),
      field("focus_distance_m", &Lens::focus_distance_m, "None: everything is in focus [m]"),
      field("vignetting", &Lens::vignetting,
            "a1, a2, ... of the transmission 1 + a1 q^2 + a2 q^4 + ..., q = 1 in the farthest "
            "corner"),
      field("veiling_glare", &Lens::veiling_glare, "part of the light that spreads evenly"),
      field("ghosts", &Lens::ghosts, "second images inside the lens"));
}

auto ghost_fields() {
  return std::make_tuple(
      field("strength", &Ghost::strength, "part of the light that goes there"),
      field("scale", &Ghost::scale, "about the principal point; negative: turned"),
      field("blur_px", &Ghost::blur_px, "of its own, beside the lens's [px]"));
}

auto box_fields() {
  return std::make_tuple(required_field("min_m", &Box::min_m, "(3,) lowest corner [m, world]"),
                         required_field("max_m", &Box::max_m, "(3,) highest corner [m, world]"));
}

auto lamp_fields() {
  return std::make_tuple(
      required_field("id", &Lamp::id, "unique in its scene"),
      required_field("centre_m", &Lamp::centre_m, "(3,) centre of the lit face [m, world]"),
      field("normal", &Lamp::normal, "(3,) towards the lit side; made unit"),
      field("radius_m", &Lamp::radius_m, "of a disc [m]"),
      field("power_w", &Lamp::power_w, "radiant power while lit [W]"),
      field("half_power_rad", &Lamp::half_power_rad, "half-power semi-angle [rad]"),
      field("frequency_hz", &Lamp::frequency_hz, "blink code [Hz]; None: always lit"),
      field("shape", &Lamp::shape, "disc, rectangle, point or lame"),
      field("size_m", &Lamp::size_m,
            "(2,) of a rectangle or Lame curve: along x_axis, across it [m]"),
      field("x_axis", &Lamp::x_axis, "(3,) of a rectangle or Lame curve: in its plane; made unit"),
      field("exponent", &Lamp::exponent, "of a Lame curve, 1 to 100; 2: an ellipse"),
      field("name", &Lamp::name, "for people"),
      field("duty", &Lamp::duty, "lit fraction of a blink period"),
      field("waveform", &Lamp::waveform,
            "instead: light over power_w in equal parts of a period, such as a code's chips"),
      field("phase", &Lamp::phase, "periods that have passed at time 0"),
      field("code", &Lamp::code, "what it says, a LampCode; sets frequency_hz and waveform"),
      field("colour", &Lamp::colour, "(3,) light that red, green, blue pixels get, over white's"),
      field("power_sigma", &Lamp::power_sigma, "relative standard deviation of power_w"));
}

auto room_fields() {
  return std::make_tuple(field("size_m", &Room::size_m, "(3,) box with a corner at the origin [m]"),
                         field("wall_reflectance", &Room::wall_reflectance, "0 to 1"));
}

auto prior_fields() {
  return std::make_tuple(
      field("position_m", &Prior::position_m, "(3,) of the camera [m, world]"),
      field("position_sigma_m", &Prior::position_sigma_m, "standard deviation per axis [m]"),
      field("position_sigmas_m", &Prior::position_sigmas_m,
            "(3,) instead, along x, y, z; infinite where nothing is known [m]"),
      field("height_m", &Prior::height_m, "of the camera: its z [m]"),
      field("height_sigma_m", &Prior::height_sigma_m, "its standard deviation [m]"),
      field("heading_rad", &Prior::heading_rad, "as heading_rad() defines it [rad]"),
      field("heading_sigma_rad", &Prior::heading_sigma_rad, "its standard deviation [rad]"),
      field("gravity_in_cam", &Prior::gravity_in_cam, "(3,) unit, down, in the camera's frame"),
      field("gravity_sigma_rad", &Prior::gravity_sigma_rad, "its standard deviation [rad]"),
      field("last_pose", &Prior::last_pose,
            "(cam_from_world, 6x6 covariance): where a tracker expects the camera"));
}

void define_enums(py::module_& m) {
  py::native_enum<LampShape>(m, "LampShape", "enum.Enum", "Shape of a lamp's lit face.")
      .value("disc", LampShape::disc)
      .value("rectangle", LampShape::rectangle)
      .value("point", LampShape::point)
      .value("lame", LampShape::lame)
      .finalize();
  py::native_enum<Response>(m, "Response", "enum.Enum",
                            "How the linear signal becomes the stored grey level.")
      .value("linear", Response::linear)
      .value("gamma", Response::gamma)
      .value("srgb", Response::srgb)
      .value("table", Response::table)
      .finalize();
  py::native_enum<Mosaic>(m, "Mosaic", "enum.Enum", "Colour filters over the pixels.")
      .value("none", Mosaic::none)
      .value("rggb", Mosaic::rggb)
      .value("grbg", Mosaic::grbg)
      .value("gbrg", Mosaic::gbrg)
      .value("bggr", Mosaic::bggr)
      .finalize();
  py::native_enum<Readout>(m, "Readout", "enum.Enum",
                           "Which pixels a rolling shutter exposes together.")
      .value("rows", Readout::rows)
      .value("columns", Readout::columns)
      .value("unknown", Readout::unknown)
      .finalize();
}

Scene make_scene(const Camera& camera, const std::vector<Lamp>& lamps,
                 const std::optional<Sensor>& sensor, const std::optional<Room>& room,
                 const std::optional<Lens>& lens, const std::vector<Box>& boxes,
                 double ambient_w_m2, const std::optional<Effects>& effects,
                 const std::vector<Tag>& tags) {
  Scene scene;
  scene.camera = camera;
  scene.lamps = lamps;
  if (sensor) scene.sensor = *sensor;
  scene.room = room;
  if (lens) scene.lens = *lens;
  scene.boxes = boxes;
  scene.ambient_w_m2 = ambient_w_m2;
  if (effects) scene.effects = *effects;
  scene.tags = tags;
  scene.validate();
  return scene;
}

Scene parse_text(const std::string& text) {
  try {
    return parse_scene(text);
  } catch (const std::runtime_error& error) {
    throw py::value_error(error.what());
  }
}

std::string scene_repr(const Scene& scene) {
  std::string ids;
  for (const Lamp& lamp : scene.lamps) ids += (ids.empty() ? "" : ", ") + std::to_string(lamp.id);
  return "<Scene: camera " + std::to_string(scene.camera.width()) + "x" +
         std::to_string(scene.camera.height()) + ", " + std::to_string(scene.lamps.size()) +
         " lamps [" + ids + "]" + (scene.room ? ", room" : "") + ">";
}

void define_scene_class(py::module_& m) {
  py::class_<Scene>(m, "Scene", R"(What is known before a picture is taken: camera, sensor, lamps.

camera: Camera. lamps: Lamps with different ids. sensor: Sensor, default one when None.
room: Room or None. lens: Lens. boxes: what hides lamps. ambient_w_m2: light on the sensor that
comes from no lamp. effects: which of all this simulate() renders. tags: AprilTags as landmarks.
Raises: ValueError naming the part, the field and its value.

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
>>> occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
<Scene: camera 640x480, 1 lamps [7]>)")
      .def(py::init(&make_scene), py::kw_only(), py::arg("camera"), py::arg("lamps"),
           py::arg("sensor") = py::none(), py::arg("room") = py::none(),
           py::arg("lens") = py::none(), py::arg("boxes") = std::vector<Box>{},
           py::arg("ambient_w_m2") = 0.0, py::arg("effects") = py::none(),
           py::arg("tags") = std::vector<Tag>{})
      .def_static(
          "load", [](const std::filesystem::path& path) { return reading(path, &read_scene); },
          py::arg("path"),
          R"(Scene from a YAML file (the schema is in data/scenes/README.md).

Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key
  and value.)")
      .def(
          "save",
          [](const Scene& scene, const std::filesystem::path& path) {
            writing(path, [&](const std::string& name) { write_scene(name, scene); });
          },
          py::arg("path"), "Writes a YAML file that load() reads back to an equal scene.")
      .def_static("parse", &parse_text, py::arg("text"),
                  "Scene from YAML text. Raises: ValueError naming line, key and value.")
      .def("format", &format_scene, "The YAML text that save() writes.")
      .def_readonly("camera", &Scene::camera, "Camera.")
      .def_readonly("sensor", &Scene::sensor, "Sensor.")
      .def_property_readonly(
          "lamps",
          [](const Scene& scene) -> py::typing::Tuple<Lamp, py::ellipsis> {
            return py::tuple(py::cast(scene.lamps));
          },
          "Lamps, a tuple: a scene does not change.")
      .def_readonly("room", &Scene::room, "Room or None.")
      .def_readonly("lens", &Scene::lens, "Lens.")
      .def_property_readonly(
          "boxes",
          [](const Scene& scene) -> py::typing::Tuple<Box, py::ellipsis> {
            return py::tuple(py::cast(scene.boxes));
          },
          "Boxes, a tuple.")
      .def_property_readonly(
          "tags",
          [](const Scene& scene) -> py::typing::Tuple<Tag, py::ellipsis> {
            return py::tuple(py::cast(scene.tags));
          },
          "Tags, a tuple.")
      .def_readonly("ambient_w_m2", &Scene::ambient_w_m2, "On the sensor [W/m^2].")
      .def_readonly("effects", &Scene::effects, "Effects.")
      .def("as_rendered", &Scene::as_rendered,
           "The scene without what its effects switch off, such as vignetting or the response "
           "curve:\nfor whoever measures images that were rendered so.")
      .def(
          "replace",
          [](const Scene& s, const std::optional<Camera>& camera,
             const std::optional<std::vector<Lamp>>& lamps, const std::optional<Sensor>& sensor,
             const std::optional<Room>& room, const std::optional<Lens>& lens,
             const std::optional<std::vector<Box>>& boxes, std::optional<double> ambient_w_m2,
             const std::optional<Effects>& effects, const std::optional<std::vector<Tag>>& tags) {
            return make_scene(camera.value_or(s.camera), lamps.value_or(s.lamps),
                              sensor.value_or(s.sensor), room ? room : s.room,
                              lens.value_or(s.lens), boxes.value_or(s.boxes),
                              ambient_w_m2.value_or(s.ambient_w_m2), effects.value_or(s.effects),
                              tags.value_or(s.tags));
          },
          py::kw_only(), py::arg("camera") = py::none(), py::arg("lamps") = py::none(),
          py::arg("sensor") = py::none(), py::arg("room") = py::none(),
          py::arg("lens") = py::none(), py::arg("boxes") = py::none(),
          py::arg("ambient_w_m2") = py::none(), py::arg("effects") = py::none(),
          py::arg("tags") = py::none(), "A copy with the parts that are given changed.")
      .def("__repr__", &scene_repr)
      .def("__eq__",
           [](const Scene& a, const py::object& b) {
             return py::isinstance<Scene>(b) &&
                    format_scene(a) == format_scene(b.cast<const Scene&>());
           })
      .def("__hash__", [](const Scene& s) { return py::hash(py::str(format_scene(s))); })
      .def(py::pickle(&format_scene, &parse_text));
}

}  // namespace

void define_scene(py::module_& m) {
  define_enums(m);
  define_documented<Channel>(m, "Channel", "What differs in the pixels of one colour.",
                             channel_fields());
  define_documented<Sensor>(m, "Sensor", "The camera as a light meter: exposure, noise, response.",
                            sensor_fields());
  define_documented<Lamp>(m, "Lamp", "A lamp: where it is, its shape, how it shines and blinks.",
                          lamp_fields());
  define_documented<Room>(m, "Room", "A box room with one corner at the world's origin.",
                          room_fields());
  define_documented<Ghost>(m, "Ghost", "A faint second image of everything inside the lens.",
                           ghost_fields());
  define_documented<Lens>(m, "Lens", "What a lens does to the light beside projecting it.",
                          lens_fields());
  define_documented<Box>(m, "Box", "Something opaque, its sides along the world's axes.",
                         box_fields());
  define_effects(m);
  define_tag(m);
  define_documented<Prior>(m, "Prior", "What is known of a pose beforehand; each part is optional.",
                           prior_fields());
  define_scene_class(m);
}

}  // namespace occ::python
