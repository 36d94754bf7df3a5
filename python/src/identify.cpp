// SPDX-License-Identifier: Apache-2.0
// P3P, identification and refinement: the steps that locate() strings together.
#include "libocc/identify/identify.hpp"

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"
#include "tables.hpp"

namespace occ::python {
namespace {

void define_symmetry(py::module_& m) {
  py::native_enum<SymmetryKind>(m, "SymmetryKind", "enum.Enum",
                                "What takes one explanation of an image to another.")
      .value("turn", SymmetryKind::turn, "about an axis")
      .value("shift", SymmetryKind::shift, "along the map")
      .value("screw", SymmetryKind::screw, "both")
      .value("planar_flip", SymmetryKind::planar_flip, "the same names, seen from elsewhere")
      .value("none", SymmetryKind::none, "the map does not repeat")
      .finalize();
  ResultClass<Symmetry>(m, "Symmetry", "How the map repeats from one explanation to another.")
      .def_readonly("kind", &Symmetry::kind, "Turn, shift, screw, planar_flip or none.")
      .def_readonly("world_from_world", &Symmetry::world_from_world,
                    "4x4: takes the best explanation's lamps and camera to the rival's.")
      .def_readonly("misfit_m", &Symmetry::misfit_m,
                    "Root mean square of what is left between the lamps [m].")
      .def_readonly("text", &Symmetry::text, "For people.")
      .def("__repr__", [](const Symmetry& s) { return "<Symmetry: " + s.text + ">"; });
}

void define_matches(py::module_& m) {
  py::native_enum<IdentifyMethod>(m, "IdentifyMethod", "enum.Enum",
                                  "How poses that explain an image are searched for.")
      .value("automatic", IdentifyMethod::automatic, "alignment for small maps, else voting")
      .value("alignment", IdentifyMethod::alignment, "every naming of a few blob triples")
      .value("voting", IdentifyMethod::voting,
             "all namings in single precision, the best looked at")
      .value("ransac", IdentifyMethod::ransac, "random namings until a better one is unlikely")
      .value("clustering", IdentifyMethod::clustering, "poses of all namings; where many agree")
      .value("hashing", IdentifyMethod::hashing, "triangles by their shape, where gravity is known")
      .finalize();
  py::class_<LampIndex>(m, "LampIndex",
                        "Shapes of all triangles of near lamps, made once for a map: what "
                        "identification by hashing looks up.")
      .def(py::init([](const Scene& scene) { return LampIndex(scene.lamps); }), py::arg("scene"))
      .def_property_readonly("applies", &LampIndex::applies,
                             "Whether four fifths of the lamps hang at one height.")
      .def_property_readonly("triangles", &LampIndex::triangles, "Their number.")
      .def("__repr__", [](const LampIndex& index) {
        return "<LampIndex: " + std::to_string(index.triangles()) + " triangles>";
      });
  py::class_<Match> match(m, "Match", "Which lamp of the scene is which blob: two indices.");
  const auto fields = std::make_tuple(required_field("lamp", &Match::lamp, "index in scene.lamps"),
                                      required_field("blob", &Match::blob, "index in the blobs"));
  define_value(match, fields);
  match.def("__repr__", [](const Match& pair) {
    return "Match(lamp=" + std::to_string(pair.lamp) + ", blob=" + std::to_string(pair.blob) + ")";
  });

  define_symmetry(m);
  ResultClass<Hypothesis>(m, "Hypothesis", "One way to explain an image.")
      .def_readonly("cam_from_world", &Hypothesis::cam_from_world, "Coarse pose, 4x4.")
      .def_readonly("matches", &Hypothesis::matches, "Matches, sorted by lamp.")
      .def_readonly("chi2", &Hypothesis::chi2, "Of centroids, prior and missed lamps.")
      .def_readonly("missed", &Hypothesis::missed, "Lamps that should be in view but are not.")
      .def_readonly("brightness_chi2", &Hypothesis::brightness_chi2,
                    "Of fluxes and sizes about one common gain.")
      .def_readonly("symmetry", &Hypothesis::symmetry,
                    "What takes the best hypothesis to this one; None for the best.")
      .def("__repr__", [](const Hypothesis& h) {
        return "<Hypothesis: " + std::to_string(h.matches.size()) + " matches, " +
               std::to_string(h.missed) + " missed, chi2 " + value_repr(h.chi2) + ">";
      });

  using Identified = Result<Identification>;
  ResultClass<Identified> identified(m, "Identification", "Which blob is which lamp, all answers.");
  define_result(identified);
  identified
      .def_property_readonly(
          "hypotheses", [](const Identified& r) { return r.value.hypotheses; },
          "Hypotheses, best first.")
      .def_property_readonly(
          "tried", [](const Identified& r) { return r.value.tried; }, "Poses tried.")
      .def_property_readonly(
          "chance", [](const Identified& r) { return r.value.chance; },
          "Expected number of wrong poses that explain as many blobs by accident.")
      .def("__repr__", [](const Identified& r) {
        return "<Identification: " + std::string(to_string(r.status)) + ", " +
               std::to_string(r.value.hypotheses.size()) + " hypotheses>";
      });
}

void define_identify_function(py::module_& m) {
  const auto fields = identify_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "identify",
            [fields](const std::vector<Blob>& blobs, const Scene& scene,
                     const std::optional<Prior>& prior,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              auto options = from_values<IdentifyOptions>(fields, values...);
              options.prior = prior;
              py::gil_scoped_release unlocked;
              return identify(blobs, scene, options);
            },
            py::arg("blobs"), py::arg("scene"), py::arg("prior") = py::none(), py::kw_only(),
            argument(f, texts)...,
            ("Which blob is which lamp: by blink code, by geometry, with or without a prior.\n\n"
             "Returns: Identification with every pose that is consistent with the map, ranked." +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

}  // namespace

void define_identify(py::module_& m) {
  define_matches(m);
  define_identify_function(m);
}

}  // namespace occ::python
