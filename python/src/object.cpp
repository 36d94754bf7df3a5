// SPDX-License-Identifier: Apache-2.0
// Objects of points: files, poses, recognition, detectable points of meshes and their value for
// localisation.
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
  using P = ObjectPoint;
  define_documented<P>(
      m, "ObjectPoint", "A point of an object that can be found in an image, such as a lamp.",
      std::make_tuple(required_field("id", &P::id, "unique in its object"),
                      required_field("position_m", &P::position_m, "(3,) [m, object's frame]"),
                      field("normal", &P::normal, "(3,) axis of its cone; made unit"),
                      field("cone_rad", &P::cone_rad,
                            "half angle of the cone from which it is visible [rad]; pi: from "
                            "everywhere"),
                      field("radius_m", &P::radius_m, "radius of a disc [m]; 0: a point"),
                      field("label", &P::label, "description")));
  py::class_<Object> object(m, "Object",
                            R"(An object, described by its points that can be found in an image.

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
          py::arg("path"), R"(Reads a YAML file (the schema is in data/objects/README.md).

Raises: FileNotFoundError or OSError when it cannot be opened; ValueError naming file, line, key
  and value.)")
      .def(
          "save",
          [](const Object& o, const std::filesystem::path& path) {
            writing(path, [&](const std::string& name) { write_object(name, o); });
          },
          py::arg("path"), "Writes a YAML file; load() returns an equal object.")
      .def_static(
          "parse",
          [](const std::string& text) {
            try {
              return parse_object(text);
            } catch (const std::runtime_error& error) {
              throw py::value_error(error.what());
            }
          },
          py::arg("text"), "Reads YAML text. Raises: ValueError naming line, key and value.")
      .def("format", &format_object, "Returns the YAML text that save() writes.");
}

void define_identify_object(py::module_& m) {
  const auto fields = identify_verdict_fields();
  define_function(
      m, "identify_object", fields,
      [](IdentifyOptions options, const std::vector<Blob>& blobs, const Object& object,
         const Camera& camera, const std::optional<Prior>& prior) {
        options.prior = prior;
        py::gil_scoped_release unlocked;
        return identify_object(blobs, object, camera, options);
      },
      py::arg("blobs"), py::arg("object"), py::arg("camera"), py::arg("prior") = py::none(),
      py::kw_only(),
      ("Assigns blobs to the points of an object and returns all plausible poses with their "
       "risk.\n\n"
       "prior: for cam_from_world; the world frame is the object's frame.\n"
       "Returns: Identification, most probable pose first; cam_from_world is cam_from_object, "
       "Match.lamp an index in object.points." +
       fields_doc(fields, "Options"))
          .c_str());
}

void define_recognition(py::module_& m) {
  using M = ObjectMatch;
  ResultClass<M>(m, "ObjectMatch", "An object with the poses that match its points to blobs.")
      .def_readonly("object", &M::object, "Index in the list of objects.")
      .def_readonly("poses", &M::poses,
                    "List of Hypothesis, most probable first; the world frame is the object's "
                    "frame.")
      .def_readonly("plausible", &M::plausible,
                    "Number of poses with at least 1/1000 of the probability of the first.")
      .def_readonly(
          "log10_false_alarms", &M::log10_false_alarms,
          "Base-10 logarithm of the expected number of matches as good by chance, by any object.")
      .def("__repr__", [](const M& match) {
        return "<ObjectMatch: object " + std::to_string(match.object) + ", " +
               std::to_string(match.poses.empty() ? 0 : match.poses.front().matches.size()) +
               " blobs, log10_false_alarms " + value_repr(match.log10_false_alarms) + ">";
      });
  using O = RecognisedObject;
  ResultClass<O>(m, "RecognisedObject", "An object found in an image.")
      .def_readonly("match", &O::match, "ObjectMatch.")
      .def_readonly("risk", &O::risk, "Probability that object or pose is wrong.")
      .def_readonly("status", &O::status,
                    "Status; ok: the risk is at most max_risk, else ambiguous.")
      .def_readonly("rivals", &O::rivals,
                    "ObjectMatches of other objects that match some of the blobs as well.")
      .def("__repr__", [](const O& o) {
        return "<RecognisedObject: " + std::string(to_string(o.status)) + ", object " +
               std::to_string(o.match.object) + ", risk " + value_repr(o.risk) + ">";
      });
  using R = Result<Recognition>;
  ResultClass<R> recognition(m, "Recognition", "Objects found in an image, with their poses.");
  define_result(recognition);
  recognition
      .def_property_readonly(
          "found", [](const R& r) { return r.value.found; },
          "RecognisedObjects, largest evidence first.")
      .def_property_readonly(
          "log10_false_alarms", [](const R& r) { return r.value.log10_false_alarms; },
          "Best match of each object, accepted or not; inf: no match.")
      .def("__repr__", [](const R& r) {
        return "<Recognition: " + std::string(to_string(r.status)) + ", " +
               std::to_string(r.value.found.size()) + " found>";
      });
}

void define_recognise(py::module_& m) {
  const auto fields = identify_verdict_fields();
  define_function(
      m, "recognise", fields,
      [](IdentifyOptions identify, const std::vector<Blob>& blobs,
         const std::vector<Object>& objects, const Camera& camera,
         const std::optional<Prior>& prior, double max_false_alarms) {
        RecogniseOptions options;
        options.identify = std::move(identify);
        options.identify.prior = prior;
        options.max_false_alarms = max_false_alarms;
        py::gil_scoped_release unlocked;
        return recognise(blobs, objects, camera, options);
      },
      py::arg("blobs"), py::arg("objects"), py::arg("camera"), py::arg("prior") = py::none(),
      py::kw_only(), py::arg("max_false_alarms") = RecogniseOptions{}.max_false_alarms,
      ("Recognises objects in an image, with their poses and expected false alarms.\n\n"
       "max_false_alarms: maximum expected number of matches as good by chance.\n"
       "Returns: Recognition. Each blob belongs to one object; an object can occur twice." +
       fields_doc(fields, "Options"))
          .c_str());
}

void define_detectable_points(py::module_& m) {
  using D = DetectablePoint;
  ResultClass<D>(m, "DetectablePoint", "A vertex where long sharp edges of a body meet.")
      .def_readonly("point", &D::point, "ObjectPoint; its id is its rank.")
      .def_readonly("edges", &D::edges, "Number of edges that meet there.")
      .def_readonly("edges_m", &D::edges_m, "Total length of these edges [m].")
      .def("__repr__", [](const D& d) {
        return "<DetectablePoint: " + value_repr(d.point.position_m) + ", " +
               std::to_string(d.edges) + " edges>";
      });
  using O = DetectableOptions;
  const auto fields = std::make_tuple(
      field("sharp_rad", &O::sharp_rad, "minimum angle between the faces of a sharp edge [rad]"),
      field("straight_rad", &O::straight_rad, "edges at a smaller angle are joined [rad]"),
      field("min_edge", &O::min_edge, "minimum length of an edge [diagonal of the bounding box]"),
      field("max_points", &O::max_points, "maximum number of points, those with the longest edges"),
      field("directions", &O::directions, "number of directions from which visibility is tested"));

  define_function(
      m, "detectable_points", fields,
      [](O options, const Rows3& vertices, const RowIndices& faces) {
        const Eigen::Matrix3Xd v = vertices.transpose();
        const Eigen::Matrix3Xi i = faces.transpose();
        py::gil_scoped_release unlocked;
        return detectable_points(v, i, options);
      },
      py::arg("vertices"), py::arg("faces"), py::kw_only(),
      ("Finds the points of a mesh that are detectable in images: where long sharp edges "
       "meet.\n\n"
       "vertices: (n, 3) [m]. faces: (k, 3) indices, counterclockwise seen from outside;\n"
       "read_mesh() gives both. Returns: DetectablePoints, longest edges first.\n"
       "Raises: ValueError naming the argument." +
       fields_doc(fields, "Options"))
          .c_str());
}

void define_localisation_value(py::module_& m) {
  using P = PointValue;
  ResultClass<P>(m, "PointValue",
                 "Contribution of a point of an object to the accuracy of its pose.")
      .def_readonly("seen", &P::seen, "Share of the views in which the point is visible.")
      .def_readonly("needed", &P::needed,
                    "Share of the views with a pose that have none without the point.")
      .def_readonly("growth", &P::growth,
                    "Mean growth of the pose's sigmas without the point, in the other views.")
      .def("__repr__", [](const P& p) {
        return "<PointValue: seen " + value_repr(p.seen) + ", growth " + value_repr(p.growth) + ">";
      });
  using L = LocalisationValue;
  ResultClass<L>(m, "LocalisationValue",
                 "Accuracy of a pose determined by the points of an object.")
      .def_readonly("points", &L::points, "List of PointValue, in the order of the object.")
      .def_readonly("determined", &L::determined, "Share of the views that determine a pose.")
      .def_readonly("sigma_m", &L::sigma_m,
                    "Median bound of the camera position in these views [m].")
      .def_readonly("sigma_rad", &L::sigma_rad,
                    "Median bound of the camera rotation in these views [rad].");
  m.def("views_around", &views_around, py::arg("object"), py::arg("distances_m"),
        py::arg("directions") = 100,
        "Returns cam_from_object (4x4 each) of cameras that view the centre of an object from all "
        "sides.");
  m.def("localisation_value", &localisation_value, py::arg("object"), py::arg("camera"),
        py::arg("cam_from_object"), py::arg("sigma_px"),
        R"(Evaluates the points of an object for localisation.

Computes the share of views in which each point is visible, and the growth of the Cramer-Rao bound
of the pose without it.

cam_from_object: views, such as views_around(). sigma_px: error of each pixel coordinate.
Returns: LocalisationValue.
Raises: ValueError if there are no views or sigma_px is not positive.)");
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
