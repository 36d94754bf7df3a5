// SPDX-License-Identifier: Apache-2.0
// Objects of points: files, poses, recognition, points of bodies and what they are worth.
#include "libocc/scene/object.hpp"

#include <pybind11/stl/filesystem.h>

#include "fields.hpp"
#include "libocc/identify/recognise.hpp"
#include "libocc/refine/localisation_value.hpp"
#include "libocc/scene/detectable_points.hpp"
#include "libocc/scene/internal/scene_fields.hpp"
#include "module.hpp"
#include "results.hpp"
#include "rows.hpp"
#include "tables.hpp"

namespace occ::python {
namespace {

using RowIndices = Eigen::Ref<const Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>>;

void define_object(py::module_& m) {
  define_documented<ObjectPoint>(
      m, "ObjectPoint", "A point of an object that is detectable in an image, such as a lamp.",
      internal::scene::object_point_fields);
  py::class_<Object> object(m, "Object",
                            R"(An object by the points of it that can be found in an image.

name: a word. points: ObjectPoints with different ids at different places.
Raises: ValueError naming the point, the field and its value.)");
  define_value(object, internal::scene::object_fields);
  object
      .def("__repr__",
           [](const Object& o) {
             return "<Object: " + o.name + ", " + std::to_string(o.points.size()) + " points>";
           })
      .def_static(
          "load", [](const std::filesystem::path& path) { return reading(path, &read_object); },
          py::arg("path"), R"(From a YAML file (the schema is in data/objects/README.md).

Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key
  and value.)")
      .def(
          "save",
          [](const Object& o, const std::filesystem::path& path) {
            writing(path, [&](const std::string& name) { write_object(name, o); });
          },
          py::arg("path"), "Writes a YAML file that load() reads back to an equal object.")
      .def_static(
          "parse",
          [](const std::string& text) {
            try {
              return parse_object(text);
            } catch (const std::runtime_error& error) {
              throw py::value_error(error.what());
            }
          },
          py::arg("text"), "From YAML text. Raises: ValueError naming line, key and value.")
      .def("format", &format_object, "The YAML text that save() writes.");
}

void define_identify_object(py::module_& m) {
  const auto fields = identify_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "identify_object",
            [fields](const std::vector<Blob>& blobs, const Object& object, const Camera& camera,
                     const std::optional<Prior>& prior,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              auto options = from_values<IdentifyOptions>(fields, values...);
              options.prior = prior;
              py::gil_scoped_release unlocked;
              return identify_object(blobs, object, camera, options);
            },
            py::arg("blobs"), py::arg("object"), py::arg("camera"), py::arg("prior") = py::none(),
            py::kw_only(), argument(f, texts)...,
            ("Which blob is which point of an object, and every pose that explains them.\n\n"
             "prior: of cam_from_world, the world being the object's frame.\n"
             "Returns: Identification; cam_from_world is of the object's frame, Match.lamp an "
             "index in object.points." +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

void define_recognition(py::module_& m) {
  using M = ObjectMatch;
  ResultClass<M>(m, "ObjectMatch", "An object that explains blobs, and how well.")
      .def_readonly("object", &M::object, "Index in the objects given.")
      .def_readonly("poses", &M::poses, "Hypotheses, best first; the world is the object's frame.")
      .def_readonly("plausible", &M::plausible, "Of them: no less likely than 1/1000 of the first.")
      .def_readonly("log10_false_alarms", &M::log10_false_alarms,
                    "Of how often chance would bring as much in such an image, by any object.")
      .def("__repr__", [](const M& match) {
        return "<ObjectMatch: object " + std::to_string(match.object) + ", " +
               std::to_string(match.poses.empty() ? 0 : match.poses.front().matches.size()) +
               " blobs, log10_false_alarms " + value_repr(match.log10_false_alarms) + ">";
      });
  using O = RecognisedObject;
  ResultClass<O>(m, "RecognisedObject", "An object that is in an image.")
      .def_readonly("match", &O::match, "ObjectMatch.")
      .def_readonly("status", &O::status, "Status.ambiguous: several poses, or rivals.")
      .def_readonly("rivals", &O::rivals, "ObjectMatches that explain the same blobs as well.")
      .def("__repr__", [](const O& o) {
        return "<RecognisedObject: " + std::string(to_string(o.status)) + ", object " +
               std::to_string(o.match.object) + ">";
      });
  using R = Result<Recognition>;
  ResultClass<R> recognition(m, "Recognition", "Which objects are in an image, and where.");
  define_result(recognition);
  recognition
      .def_property_readonly(
          "found", [](const R& r) { return r.value.found; }, "RecognisedObjects, surest first.")
      .def_property_readonly(
          "log10_false_alarms", [](const R& r) { return r.value.log10_false_alarms; },
          "Of each object given, at its best, found or not; inf: not worth a look.")
      .def("__repr__", [](const R& r) {
        return "<Recognition: " + std::string(to_string(r.status)) + ", " +
               std::to_string(r.value.found.size()) + " found>";
      });
}

void define_recognise(py::module_& m) {
  const auto fields = identify_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "recognise",
            [fields](const std::vector<Blob>& blobs, const std::vector<Object>& objects,
                     const Camera& camera, const std::optional<Prior>& prior,
                     double max_false_alarms,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              RecogniseOptions options;
              options.identify = from_values<IdentifyOptions>(fields, values...);
              options.identify.prior = prior;
              options.max_false_alarms = max_false_alarms;
              py::gil_scoped_release unlocked;
              return recognise(blobs, objects, camera, options);
            },
            py::arg("blobs"), py::arg("objects"), py::arg("camera"), py::arg("prior") = py::none(),
            py::kw_only(), py::arg("max_false_alarms") = RecogniseOptions{}.max_false_alarms,
            argument(f, texts)...,
            ("Which of several objects are in an image, where, and how likely that is chance.\n\n"
             "max_false_alarms: an object is there when chance brings fewer, in such an image.\n"
             "Returns: Recognition. A blob is of one object; an object may be there twice." +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

void define_detectable_points(py::module_& m) {
  using D = DetectablePoint;
  ResultClass<D>(m, "DetectablePoint", "A vertex where long sharp edges of a body meet.")
      .def_readonly("point", &D::point, "ObjectPoint; its id is its rank.")
      .def_readonly("edges", &D::edges, "How many meet there.")
      .def_readonly("edges_m", &D::edges_m, "Their length [m].")
      .def("__repr__", [](const D& d) {
        return "<DetectablePoint: " + value_repr(d.point.position_m) + ", " +
               std::to_string(d.edges) + " edges>";
      });
  using O = DetectableOptions;
  const auto fields = internal::scene::detectable_fields;
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "detectable_points",
            [fields](const Rows3& vertices, const RowIndices& faces,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              const auto options = from_values<O>(fields, values...);
              const Eigen::Matrix3Xd v = vertices.transpose();
              const Eigen::Matrix3Xi i = faces.transpose();
              py::gil_scoped_release unlocked;
              return detectable_points(v, i, options);
            },
            py::arg("vertices"), py::arg("faces"), py::kw_only(), argument(f, texts)...,
            ("Points of a body that can be found in images: where long sharp edges meet.\n\n"
             "vertices: (n, 3) [m]. faces: (k, 3) indices, counterclockwise seen from outside;\n"
             "read_mesh() gives both. Returns: DetectablePoints, longest edges first.\n"
             "Raises: ValueError naming what is wrong." +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

void define_localisation_value(py::module_& m) {
  using P = PointValue;
  ResultClass<P>(m, "PointValue", "What a point of an object is worth for its pose.")
      .def_readonly("seen", &P::seen, "Share of the views that show it.")
      .def_readonly("needed", &P::needed, "Share of the views with a pose that have none without.")
      .def_readonly("growth", &P::growth, "Of the pose's sigmas without it, elsewhere; a mean.")
      .def("__repr__", [](const P& p) {
        return "<PointValue: seen " + value_repr(p.seen) + ", growth " + value_repr(p.growth) + ">";
      });
  using L = LocalisationValue;
  ResultClass<L>(m, "LocalisationValue", "How well an object's points determine its pose.")
      .def_readonly("points", &L::points, "PointValues, in the object's order.")
      .def_readonly("determined", &L::determined, "Share of the views that determine a pose.")
      .def_readonly("sigma_m", &L::sigma_m, "Median bound of the camera's position there [m].")
      .def_readonly("sigma_rad", &L::sigma_rad, "Median bound of its rotation there [rad].");
  m.def("views_around", &views_around, py::arg("object"), py::arg("distances_m"),
        py::arg("directions") = 100,
        "cam_from_object (4x4 each) of cameras that look at an object's middle from all sides.");
  m.def("localisation_value", &localisation_value, py::arg("object"), py::arg("camera"),
        py::arg("cam_from_object"), py::arg("sigma_px"),
        R"(Which points of an object localise it well: how often each is seen, and by how much the
Cramer-Rao bound of the pose grows without it.

cam_from_object: views, such as views_around(). sigma_px: of each point's pixel coordinates.
Returns: LocalisationValue. Raises: ValueError for no views and a sigma that is not positive.)");
}

}  // namespace

void define_objects(py::module_& m) {
  define_object(m);
  define_identify_object(m);
  define_recognition(m);
  define_recognise(m);
  define_detectable_points(m);
  define_localisation_value(m);
}

}  // namespace occ::python
