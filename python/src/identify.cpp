// SPDX-License-Identifier: Apache-2.0
// Identification of lamps: matches, hypotheses, symmetries.
#include "libocc/identify/identify.hpp"

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"
#include "tables.hpp"

namespace occ::python {
namespace {

void define_pose_circle(py::module_& m) {
  using C = PoseCircle;
  ResultClass<C>(m, "PoseCircle",
                 "Poses that the outline of one disc allows: the camera is on a circle about the "
                 "disc's axis, turned with it.")
      .def_readonly("lamp", &C::lamp, "Index of the disc in Scene.lamps.")
      .def_readonly("blob", &C::blob, "Index of its image in the blobs.")
      .def_readonly("cam_from_world", &C::cam_from_world,
                    "Pose at the angle 0, which is arbitrary, 4x4.")
      .def_readonly("information", &C::information,
                    "Inverse covariance (6, 6) of the left perturbation of cam_from_world; zero "
                    "for the turn about the axis. A filter may use it as an observation.")
      .def_readonly("centre_m", &C::centre_m, "(3,) centre of the circle, in the world.")
      .def_readonly("axis", &C::axis, "(3,) normal of the disc, in the world.")
      .def_readonly("radius_m", &C::radius_m, "Distance of the camera from the axis.")
      .def_readonly("height_m", &C::height_m,
                    "Distance of the camera from the disc, along the axis.")
      .def_readonly("radius_sigma_m", &C::radius_sigma_m, "Standard deviation of radius_m.")
      .def_readonly("height_sigma_m", &C::height_sigma_m, "Standard deviation of height_m.")
      .def("at", &C::at, py::arg("angle_rad"),
           "cam_from_world (4x4) after the camera has moved along the circle by an angle.");
}

void define_symmetry(py::module_& m) {
  py::native_enum<SymmetryKind>(m, "SymmetryKind", "enum.Enum",
                                "Motion that relates two hypotheses of an image.")
      .value("rotation", SymmetryKind::rotation, "about an axis")
      .value("translation", SymmetryKind::translation, "without rotation")
      .value("screw", SymmetryKind::screw, "rotation about an axis and translation along it")
      .value("planar_flip", SymmetryKind::planar_flip,
             "the same lamps, with different camera poses")
      .value("none", SymmetryKind::none, "the map does not repeat")
      .finalize();
  ResultClass<Symmetry>(m, "Symmetry", "Symmetry of the map between two hypotheses of an image.")
      .def_readonly("kind", &Symmetry::kind, "SymmetryKind.")
      .def_readonly("world_from_world", &Symmetry::world_from_world,
                    "4x4: maps the lamps and camera of the best hypothesis to the rival's.")
      .def_readonly("misfit_m", &Symmetry::misfit_m, "Root mean square residual of the lamps [m].")
      .def_readonly("text", &Symmetry::text, "Description of the motion.")
      .def("__repr__", [](const Symmetry& s) { return "<Symmetry: " + s.text + ">"; });
}

void define_matches(py::module_& m) {
  py::native_enum<IdentifyMethod>(m, "IdentifyMethod", "enum.Enum",
                                  "Search method for candidate poses.")
      .value("automatic", IdentifyMethod::automatic, "alignment for small maps, else voting")
      .value("alignment", IdentifyMethod::alignment,
             "all assignments of a few blob triples, verified")
      .value("voting", IdentifyMethod::voting,
             "all assignments scored in single precision, the best verified")
      .value("ransac", IdentifyMethod::ransac, "random assignments until a better one is unlikely")
      .value("clustering", IdentifyMethod::clustering, "clusters of the poses of many assignments")
      .value("hashing", IdentifyMethod::hashing, "triangles looked up by shape; needs gravity")
      .finalize();
  py::class_<LampIndex>(m, "LampIndex",
                        "Index of a map for IdentifyMethod.hashing: the shapes of all triangles of "
                        "neighbouring lamps.")
      .def(py::init([](const Scene& scene) { return LampIndex(scene.lamps); }), py::arg("scene"))
      .def_property_readonly("applies", &LampIndex::applies,
                             "True if four fifths of the lamps hang at one height.")
      .def_property_readonly("triangles", &LampIndex::triangles, "Number of triangles.")
      .def("__repr__", [](const LampIndex& index) {
        return "<LampIndex: " + std::to_string(index.triangles()) + " triangles>";
      });
  py::class_<Match> match(m, "Match", "Assignment of a blob to a lamp: two indices.");
  const auto fields = std::make_tuple(required_field("lamp", &Match::lamp, "index in scene.lamps"),
                                      required_field("blob", &Match::blob, "index in the blobs"));
  define_value(match, fields);
  match.def("__repr__", [](const Match& pair) {
    return "Match(lamp=" + std::to_string(pair.lamp) + ", blob=" + std::to_string(pair.blob) + ")";
  });

  define_symmetry(m);
  define_pose_circle(m);
  ResultClass<Hypothesis>(m, "Hypothesis", "A pose with the assignment of blobs to lamps.")
      .def_readonly("cam_from_world", &Hypothesis::cam_from_world, "Coarse pose, 4x4.")
      .def_readonly("matches", &Hypothesis::matches, "Matches, sorted by lamp.")
      .def_readonly("chi2", &Hypothesis::chi2,
                    "Chi-square of centroids and prior, plus the penalties of missed lamps.")
      .def_readonly("missed", &Hypothesis::missed,
                    "Lamps that should be visible but match no blob.")
      .def_readonly("brightness_chi2", &Hypothesis::brightness_chi2,
                    "Chi-square of fluxes, up to one common gain, and sizes.")
      .def_readonly("symmetry", &Hypothesis::symmetry,
                    "Symmetry that maps the best hypothesis to this one; None for the best.")
      .def_readonly("probability", &Hypothesis::probability,
                    "Probability that it is right, among all hypotheses and 'none of these'.")
      .def("__repr__", [](const Hypothesis& h) {
        return "<Hypothesis: " + std::to_string(h.matches.size()) + " matches, " +
               std::to_string(h.missed) + " missed, probability " + value_repr(h.probability) + ">";
      });

  using Identified = Result<Identification>;
  ResultClass<Identified> identified(m, "Identification",
                                     "Assignments of blobs to lamps, with all plausible poses.");
  define_result(identified);
  identified
      .def_property_readonly(
          "hypotheses", [](const Identified& r) { return r.value.hypotheses; },
          "List of Hypothesis, most probable first.")
      .def_property_readonly(
          "risk", [](const Identified& r) { return r.value.risk; },
          "Probability that the first hypothesis is wrong; 1 without hypotheses.")
      .def_property_readonly(
          "tried", [](const Identified& r) { return r.value.tried; },
          "Assignments of three blobs tried.")
      .def_property_readonly(
          "chance", [](const Identified& r) { return r.value.chance; },
          "Expected number of wrong poses that match as many blobs.")
      .def_property_readonly(
          "cut_short", [](const Identified& r) { return r.value.cut_short; },
          "True if the search stopped at max_hypotheses or max_time_s.")
      .def_property_readonly(
          "untried", [](const Identified& r) { return r.value.untried; },
          "Share of the groups of blobs that a search that was cut short left out.")
      .def_property_readonly(
          "circles", [](const Identified& r) { return r.value.circles; },
          "PoseCircles that one disc allows, without hypotheses in an image of one or two blobs.")
      .def_property_readonly(
          "excluded", [](const Identified& r) { return r.value.excluded; },
          "List of Hypothesis that only the prior excludes, at a place that looks alike or with\n"
          "more blobs.")
      .def("__repr__", [](const Identified& r) {
        return "<Identification: " + std::string(to_string(r.status)) + ", " +
               std::to_string(r.value.hypotheses.size()) + " hypotheses, risk " +
               value_repr(r.value.risk) + ">";
      });
}

void define_identify_function(py::module_& m) {
  const auto fields = identify_verdict_fields();
  define_function(
      m, "identify", fields,
      [](IdentifyOptions options, const std::vector<Blob>& blobs, const Scene& scene,
         const std::optional<Prior>& prior) {
        options.prior = prior;
        py::gil_scoped_release unlocked;
        return identify(blobs, scene, options);
      },
      py::arg("blobs"), py::arg("scene"), py::arg("prior") = py::none(), py::kw_only(),
      ("Assigns blobs to lamps by blink code and by geometry, with or without a prior.\n\n"
       "Returns: Identification with all poses that are consistent with the map, most probable "
       "first, and the risk that the first is wrong." +
       fields_doc(fields, "Options"))
          .c_str());
}

}  // namespace

void define_identify(py::module_& m) {
  define_matches(m);
  define_identify_function(m);
}

}  // namespace occ::python
