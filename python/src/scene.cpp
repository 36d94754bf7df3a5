// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/scene.hpp"

#include <pybind11/stl/filesystem.h>
#include <pybind11/typing.h>

#include "fields.hpp"
#include "libocc/scene/internal/scene_fields.hpp"
#include "libocc/scene/scene_file.hpp"
#include "module.hpp"

namespace occ::python {

using namespace internal::radiometry;
using namespace internal::scene;
namespace {

void define_enums(py::module_& m) {
  define_enum(m, "LampShape", "Shape of a lamp's lit face.", shape_words);
  define_enum(m, "Response", "Relation between the linear signal and the stored grey level.",
              response_words);
  define_enum(m, "Mosaic", "Colour filters over the pixels.", mosaic_words);
  define_enum(m, "Readout", "Pixels that a rolling shutter exposes together.", readout_words);
}

Scene make_scene(const Camera& camera, const std::vector<Lamp>& lamps,
                 const std::optional<Sensor>& sensor, const std::optional<Room>& room,
                 const std::optional<Lens>& lens, const std::vector<Box>& boxes,
                 double ambient_w_m2, const std::optional<Effects>& effects,
                 const std::vector<Tag>& tags, const std::optional<PerAxis>& map_sigma_m,
                 double map_scale_sigma) {
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
  scene.map_sigma_m = map_sigma_m;
  scene.map_scale_sigma = map_scale_sigma;
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
  py::class_<Scene>(m, "Scene",
                    R"(Model of a room and its camera: camera, sensor, lens, lamps, boxes, tags.

camera: Camera. lamps: Lamps with different ids. sensor: Sensor; None: default values. room: Room or
None. lens: Lens. boxes: Boxes that occlude lamps. ambient_w_m2: irradiance of the sensor from other
sources than the lamps. effects: Effects that simulate() renders. tags: Tags (AprilTags) as landmarks.
map_sigma_m: standard deviation of the positions of the lamps that do not state their own
(Lamp.position_sigma_m), one number or three along the axes of the world; None: they are exact.
map_scale_sigma: relative standard deviation of the scale of the map: all positions, about their mean,
and all sizes are wrong by the same factor.
Raises: ValueError naming the part, the field and its value.

>>> import libocc as occ
>>> camera = occ.Camera.pinhole(width=640, height=480, fx_px=400, fy_px=400, cx_px=319.5, cy_px=239.5)
>>> occ.Scene(camera=camera, lamps=[occ.Lamp(id=7, centre_m=[0, 0, 3], radius_m=0.1)])
<Scene: camera 640x480, 1 lamps [7]>)")
      .def(py::init(&make_scene), py::kw_only(), py::arg("camera"), py::arg("lamps"),
           py::arg("sensor") = py::none(), py::arg("room") = py::none(),
           py::arg("lens") = py::none(), py::arg("boxes") = std::vector<Box>{},
           py::arg("ambient_w_m2") = 0.0, py::arg("effects") = py::none(),
           py::arg("tags") = std::vector<Tag>{}, py::arg("map_sigma_m") = py::none(),
           py::arg("map_scale_sigma") = 0.0)
      .def_static(
          "load",
          [](const std::filesystem::path& path, const std::optional<Camera>& camera) {
            return reading(path, [&](const std::string& name) { return read_scene(name, camera); });
          },
          py::arg("path"), py::kw_only(), py::arg("camera") = py::none(),
          R"(Reads a scene from a YAML file (the schema is in data/scenes/README.md).

camera: replaces the section `camera`, which the file then need not have.
Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key
  and value.)")
      .def(
          "save",
          [](const Scene& scene, const std::filesystem::path& path) {
            writing(path, [&](const std::string& name) { write_scene(name, scene); });
          },
          py::arg("path"), "Writes a YAML file; load() returns an equal scene. Raises: OSError.")
      .def_static("parse", &parse_text, py::arg("text"),
                  "Reads a scene from YAML text. Raises: ValueError naming line, key and value.")
      .def("format", &format_scene, "Returns the YAML text that save() writes.")
      .def_readonly("camera", &Scene::camera, "Camera.")
      .def_readonly("sensor", &Scene::sensor, "Sensor.")
      .def_property_readonly(
          "lamps",
          [](const Scene& scene) -> py::typing::Tuple<Lamp, py::ellipsis> {
            return py::tuple(py::cast(scene.lamps));
          },
          "Tuple of Lamp.")
      .def_readonly("room", &Scene::room, "Room or None.")
      .def_readonly("lens", &Scene::lens, "Lens.")
      .def_property_readonly(
          "boxes",
          [](const Scene& scene) -> py::typing::Tuple<Box, py::ellipsis> {
            return py::tuple(py::cast(scene.boxes));
          },
          "Tuple of Box.")
      .def_property_readonly(
          "tags",
          [](const Scene& scene) -> py::typing::Tuple<Tag, py::ellipsis> {
            return py::tuple(py::cast(scene.tags));
          },
          "Tuple of Tag.")
      .def_readonly("ambient_w_m2", &Scene::ambient_w_m2,
                    "Irradiance of the sensor from other sources than lamps [W/m^2].")
      .def_readonly("effects", &Scene::effects, "Effects.")
      .def_readonly("map_sigma_m", &Scene::map_sigma_m,
                    "(3,) standard deviations of the lamps' positions along the axes of the world "
                    "[m]; None: exact.")
      .def_readonly("map_scale_sigma", &Scene::map_scale_sigma,
                    "Relative standard deviation of the scale of positions and sizes alike.")
      .def(
          "as_rendered", &Scene::as_rendered,
          "Returns the scene without the effects that are switched off, such as vignetting or the\n"
          "response curve: the model of images rendered with these effects.")
      .def(
          "replace",
          [](const Scene& s, const std::optional<Camera>& camera,
             const std::optional<std::vector<Lamp>>& lamps, const std::optional<Sensor>& sensor,
             const std::optional<Room>& room, const std::optional<Lens>& lens,
             const std::optional<std::vector<Box>>& boxes, std::optional<double> ambient_w_m2,
             const std::optional<Effects>& effects, const std::optional<std::vector<Tag>>& tags,
             const std::optional<PerAxis>& map_sigma_m, std::optional<double> map_scale_sigma) {
            return make_scene(camera.value_or(s.camera), lamps.value_or(s.lamps),
                              sensor.value_or(s.sensor), room ? room : s.room,
                              lens.value_or(s.lens), boxes.value_or(s.boxes),
                              ambient_w_m2.value_or(s.ambient_w_m2), effects.value_or(s.effects),
                              tags.value_or(s.tags), map_sigma_m ? map_sigma_m : s.map_sigma_m,
                              map_scale_sigma.value_or(s.map_scale_sigma));
          },
          py::kw_only(), py::arg("camera") = py::none(), py::arg("lamps") = py::none(),
          py::arg("sensor") = py::none(), py::arg("room") = py::none(),
          py::arg("lens") = py::none(), py::arg("boxes") = py::none(),
          py::arg("ambient_w_m2") = py::none(), py::arg("effects") = py::none(),
          py::arg("tags") = py::none(), py::arg("map_sigma_m") = py::none(),
          py::arg("map_scale_sigma") = py::none(), "Returns a copy with the given parts changed.")
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
  define_documented<Channel>(m, "Channel",
                             "Parameters of the pixels of one colour, in place of the sensor's.",
                             channel_fields);
  define_documented<Sensor>(m, "Sensor",
                            "Conversion of irradiance to grey levels: exposure, noise, response.",
                            sensor_fields);
  define_photometric(m);
  define_documented<Lamp>(m, "Lamp", "A lamp: position, shape, light and blinking.", lamp_fields);
  const py::object lamp = m.attr("Lamp");
  lamp.attr("face_triangles") = py::cpp_function(
      &Lamp::face_triangles, py::name("face_triangles"), py::is_method(lamp),
      "Returns a list of [i, j, k], indices into corners_m: triangles that cover the face of a "
      "polygon. Empty for other shapes.");
  define_documented<Room>(m, "Room", "A box room with one corner at the world's origin.",
                          room_fields);
  define_documented<Ghost>(m, "Ghost", "A faint second image from two reflections inside the lens.",
                           ghost_fields);
  define_documented<Lens>(m, "Lens", "Effects of a lens on the light, besides the projection.",
                          lens_fields);
  define_documented<Box>(m, "Box", "An opaque box with its sides along the world's axes.",
                         box_fields);
  define_effects(m);
  define_tag(m);
  define_documented<Prior>(m, "Prior", "Prior knowledge of a pose; each part is optional.",
                           prior_fields);
  define_scene_class(m);
}

}  // namespace occ::python
