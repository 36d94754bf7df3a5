// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/locate.hpp"

#include <sstream>

#include "fields.hpp"
#include "module.hpp"
#include "results.hpp"
#include "tables.hpp"

namespace occ::python {
namespace {

template <class Map>
std::string keys_text(const Map& map) {
  std::string text;
  for (const auto& item : map) text += (text.empty() ? "" : ", ") + std::to_string(item.first);
  return "[" + text + "]";
}

std::string rounded(const Eigen::Vector3d& v, int digits) {
  std::ostringstream text;
  text.setf(std::ios::fixed);
  text.precision(digits);
  text << "[" << v.x() << ", " << v.y() << ", " << v.z() << "]";
  return text.str();
}

void define_refine(py::module_& m) {
  py::native_enum<Rung>(m, "Rung", "enum.Enum", "What of the image the pose has to explain.")
      .value("points", Rung::points)
      .value("centres", Rung::centres)
      .value("rims", Rung::rims)
      .value("direct", Rung::direct)
      .finalize();
  py::native_enum<FluxModel>(m, "FluxModel", "enum.Enum", "What the lamps' brightness tells.")
      .value("ignore", FluxModel::ignore)
      .value("known_power", FluxModel::known_power)
      .value("common_factor", FluxModel::common_factor)
      .finalize();
  ResultClass<LampResidual>(m, "LampResidual", "How well one lamp fits.")
      .def_readonly("match", &LampResidual::match, "Which lamp and blob.")
      .def_readonly("contradicts", &LampResidual::contradicts,
                    "Left out: the other lamps agree without it.")
      .def_readonly("rms_px", &LampResidual::rms_px, "Over its rim, or of its centroid [px].")
      .def_readonly("centre_px", &LampResidual::centre_px, "(2,) predicted centre of its image.")
      .def("__repr__", [](const LampResidual& r) {
        return "<LampResidual: lamp " + std::to_string(r.match.lamp) + ", rms " +
               value_repr(r.rms_px) + " px>";
      });

  using R = Result<Refined>;
  ResultClass<R> refined(m, "Refined", "The most likely pose for one naming of the blobs.");
  define_result(refined);
  refined.def_property_readonly("cam_from_world", value_of(&Refined::cam_from_world), "Pose, 4x4.")
      .def_property_readonly("covariance", value_of(&Refined::covariance),
                             "(6, 6) [rotation, translation], left perturbation.")
      .def_property_readonly("chi2", value_of(&Refined::chi2), "Whitened, robust.")
      .def_property_readonly("dof", value_of(&Refined::dof), "Observations minus parameters.")
      .def_property_readonly("variance_factor", value_of(&Refined::variance_factor),
                             "Contained in the covariance; 1 unless chi2 is too large for chance.")
      .def_property_readonly("rms_px", value_of(&Refined::rms_px), "Of centres over lamps [px].")
      .def_property_readonly("lamps", value_of(&Refined::lamps), "LampResidual of each match.")
      .def_property_readonly("rim_growth_px", value_of(&Refined::rim_growth_px),
                             "Of saturated lamps, or None [px].")
      .def_property_readonly("flux_factor", value_of(&Refined::flux_factor),
                             "Seen over predicted, with FluxModel.common_factor; or None.")
      .def_property_readonly("iterations", value_of(&Refined::iterations), "Steps taken.")
      .def("__repr__", [](const R& r) {
        return "<Refined: " + std::string(to_string(r.status)) + ", position " +
               rounded(r.value.cam_from_world.origin_in_source(), 4) + " m, rms " +
               value_repr(r.value.rms_px) + " px>";
      });

  const auto fields = refine_fields();
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "refine",
            [fields](const Rigid3& start, const std::vector<Match>& matches,
                     const std::vector<Blob>& blobs, const Scene& scene,
                     const std::optional<Prior>& prior,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              auto options = from_values<RefineOptions>(fields, values...);
              options.prior = prior;
              py::gil_scoped_release unlocked;
              return refine(start, matches, blobs, scene, options);
            },
            py::arg("start"), py::arg("matches"), py::arg("blobs"), py::arg("scene"),
            py::arg("prior") = py::none(), py::kw_only(), argument(f, texts)...,
            ("The most likely pose for a given naming of the blobs, with its covariance.\n\n"
             "start: 4x4 cam_from_world, for example a Hypothesis'. Returns: Refined.\n"
             "Raises: ValueError for a match outside its list." +
             fields_doc(fields, "Options"))
                .c_str());
      },
      fields);
}

void define_fix(py::module_& m) {
  using C = Candidate;
  ResultClass<C>(m, "Candidate", "One pose that explains the image.")
      .def_readonly("cam_from_world", &C::cam_from_world, "Pose, 4x4.")
      .def_readonly("covariance", &C::covariance,
                    "(6, 6) of cam_from_world [rotation, translation], left perturbation.")
      .def_readonly("position_m", &C::position_m, "(3,) of the camera [m, world].")
      .def_property_readonly(
          "position_covariance_m2",
          [](const C& c) { return position_covariance(c.cam_from_world, c.covariance); },
          "(3, 3) of the position [m^2, world].")
      .def_readonly("rms_px", &C::rms_px, "Of centres over lamps [px].")
      .def_readonly("chi2", &C::chi2, "Whitened, robust.")
      .def_readonly("dof", &C::dof, "Observations minus parameters.")
      .def_readonly("lamps", &C::lamps, "Lamp id -> Blob.")
      .def("__repr__", [](const C& c) {
        return "<Candidate: position " + rounded(c.position_m, 4) + " m, lamps " +
               keys_text(c.lamps) + ", rms " + value_repr(c.rms_px) + " px>";
      });

  ResultClass<Timing>(m, "Timing", "Where the time went [s].")
      .def_readonly("detect_s", &Timing::detect_s, "Finding blobs [s].")
      .def_readonly("identify_s", &Timing::identify_s, "Naming them [s].")
      .def_readonly("refine_s", &Timing::refine_s, "Refining poses [s].")
      .def_readonly("total_s", &Timing::total_s, "All [s].")
      .def("__repr__", [](const Timing& t) { return "<Timing: " + value_repr(t.total_s) + " s>"; });

  using R = Result<Fix>;
  ResultClass<R> fix(m, "Fix", R"(Where the camera was: the answer of locate().

What was found so far is there even when the fix is not ok: look at status and message. Without
candidates there is no pose: its covariance is infinite.)");
  define_result(fix);
  fix.def_property_readonly("position_m", value_of(&Fix::position_m),
                            "(3,) of the camera [m, world].")
      .def_property_readonly("position_covariance_m2", value_of(&Fix::position_covariance_m2),
                             "(3, 3) of the position [m^2, world].")
      .def_property_readonly("cam_from_world", value_of(&Fix::cam_from_world), "Pose, 4x4.")
      .def_property_readonly(
          "covariance", value_of(&Fix::covariance),
          "(6, 6) of cam_from_world [rotation rad, translation m], left perturbation.")
      .def_property_readonly("candidates", value_of(&Fix::candidates),
                             "Every plausible pose, best first; the first is the fix.")
      .def_property_readonly("lamps", value_of(&Fix::lamps), "Lamp id -> Blob.")
      .def_property_readonly("blobs", value_of(&Fix::blobs), "Everything detected.")
      .def_property_readonly("rms_px", value_of(&Fix::rms_px), "Of centres over lamps [px].")
      .def_property_readonly("timing_s", value_of(&Fix::timing_s), "Where the time went [s].")
      .def_property_readonly("choice", value_of(&Fix::choice),
                             "RungChoice: by which rung locate() refined, and why; or None.")
      .def("__repr__", [](const R& r) {
        const Eigen::Vector3d sigma_m = r.value.position_covariance_m2.diagonal().cwiseSqrt();
        const std::string status = "<Fix: " + std::string(to_string(r.status));
        if (r.value.candidates.empty()) return status + ", " + r.message + ">";
        return status + ", position " + rounded(r.value.position_m, 4) + " m, sigma " +
               rounded(sigma_m * 1e3, 2) + " mm, lamps " + keys_text(r.value.lamps) +
               ", candidates " + std::to_string(r.value.candidates.size()) + ">";
      });
}

auto locate_fields() {
  using O = LocateOptions;
  return std::tuple_cat(
      std::make_tuple(
          field("max_candidates", &O::max_candidates, "fitting poses returned at most"),
          field("budget_s", &O::budget_s, "time for the whole call [s]: chooses the rung"),
          field("target_sigma_m", &O::target_sigma_m,
                "error of the position [m]: chooses the rung"),
          field("costs", &O::costs, "RungCosts of this machine")),
      fields_within(&O::detect, detect_fields()), fields_within(&O::identify, identify_fields()),
      fields_within(&O::refine, refine_fields()));
}

void define_locate_function(py::module_& m) {
  const auto fields = locate_fields();
  const std::string doc =
      R"(Where was the camera when it took this image of these lamps?

image: (height, width) or (height, width, 3 or 4) array of uint8 or uint16, of the camera's size;
not copied when the pixels of a row are adjacent. Or a list of Blobs that detect() found in it.
scene: Scene. prior: Prior or None.
With a budget_s the most accurate rung is taken that is predicted to fit into what detection and
identification have left of it; with a target_sigma_m (root of the trace of the position's
covariance) the cheapest that is predicted to meet it, within the budget when there is one. `rung`
then does not count, and status budget_not_met says that none does; the fix is the best there is.
Returns: Fix; look at `ok` or `status` before using it. All plausible poses are in `candidates`.
`choice` says which rung was taken, and why.
Raises: TypeError or ValueError for another array, an image of another size than the camera's, or
a bad option.)" +
      fields_doc(fields, "Options");
  DefaultTexts texts;
  std::apply(
      [&](const auto&... f) {
        m.def(
            "locate",
            [fields](const ImageOrBlobs& given, const Scene& scene,
                     const std::optional<Prior>& prior,
                     const typename std::decay_t<decltype(f)>::value_type&... values) {
              auto options = from_values<LocateOptions>(fields, values...);
              options.prior = prior;
              py::gil_scoped_release unlocked;
              return given.image ? locate(given.image->view, scene, options)
                                 : locate(given.blobs, scene, options);
            },
            py::arg("image"), py::arg("scene"), py::arg("prior") = py::none(), py::kw_only(),
            argument(f, texts)..., doc.c_str());
      },
      fields);
}

}  // namespace

void define_locate(py::module_& m) {
  define_refine(m);
  define_bound(m);
  define_ladder(m);
  define_fix(m);
  define_locate_function(m);
}

}  // namespace occ::python
