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
  py::native_enum<Rung>(m, "Rung", "enum.Enum",
                        "Observations that a pose is fitted to; each is more accurate and slower "
                        "than the one before.")
      .value("points", Rung::points, "centroids and projected lamp centres")
      .value("centres", Rung::centres, "centroids and centres of the lamps' images")
      .value("rims", Rung::rims, "measured and projected rims")
      .value("direct", Rung::direct, "all pixels around a lamp and its rendered image")
      .finalize();
  py::native_enum<FluxModel>(m, "FluxModel", "enum.Enum",
                             "Use of the lamps' brightness as an observation.")
      .value("ignore", FluxModel::ignore, "geometry only")
      .value("known_power", FluxModel::known_power, "each power is known to its power_sigma")
      .value("common_factor", FluxModel::common_factor, "powers are known up to one factor")
      .finalize();
  ResultClass<LampResidual>(m, "LampResidual", "Residual of one lamp.")
      .def_readonly("match", &LampResidual::match, "Match of the lamp and its blob.")
      .def_readonly("contradicts", &LampResidual::contradicts,
                    "True if it was left out as a gross error.")
      .def_readonly("rms_px", &LampResidual::rms_px,
                    "Root mean square residual of its rim points, or length of its centroid "
                    "residual [px].")
      .def_readonly("centre_px", &LampResidual::centre_px,
                    "(2,) predicted centre of the lamp's image [px].")
      .def_readonly("position_error_m", &LampResidual::position_error_m,
                    "(3,) estimated error of the lamp's position in the scene, in the world [m]; "
                    "zero if it is exact.")
      .def_readonly(
          "size_error", &LampResidual::size_error,
          "Estimated relative error of the lamp's size in the scene; zero if it is exact.")
      .def("__repr__", [](const LampResidual& r) {
        return "<LampResidual: lamp " + std::to_string(r.match.lamp) + ", rms " +
               value_repr(r.rms_px) + " px>";
      });

  using R = Result<Refined>;
  ResultClass<R> refined(m, "Refined",
                         "Maximum-likelihood pose for one assignment of blobs to lamps.");
  define_result(refined);
  refined.def_property_readonly("cam_from_world", value_of(&Refined::cam_from_world), "Pose, 4x4.")
      .def_property_readonly("covariance", value_of(&Refined::covariance),
                             "(6, 6) of cam_from_world [rotation rad, translation m], left "
                             "perturbation.")
      .def_property_readonly("chi2", value_of(&Refined::chi2),
                             "Robust chi-square of lamps and prior.")
      .def_property_readonly("dof", value_of(&Refined::dof), "Observations minus parameters.")
      .def_property_readonly("variance_factor", value_of(&Refined::variance_factor),
                             "chi2 / dof, included in the covariance; 1 unless chi2 exceeds its "
                             "99.9 % quantile.")
      .def_property_readonly(
          "rms_px", value_of(&Refined::rms_px),
          "Root mean square centre residual over the lamps whose blobs are not merged [px].")
      .def_property_readonly("lamps", value_of(&Refined::lamps), "LampResidual of each match.")
      .def_property_readonly("rim_growth_px", value_of(&Refined::rim_growth_px),
                             "Common rim growth of saturated lamps [px], or None.")
      .def_property_readonly("flux_factor", value_of(&Refined::flux_factor),
                             "Measured over predicted flux with FluxModel.common_factor, or None.")
      .def_property_readonly("iterations", value_of(&Refined::iterations), "Number of steps.")
      .def("__repr__", [](const R& r) {
        return "<Refined: " + std::string(to_string(r.status)) + ", position " +
               rounded(r.value.cam_from_world.origin_in_source(), 4) + " m, rms " +
               value_repr(r.value.rms_px) + " px>";
      });

  const auto fields = refine_fields();
  define_function(
      m, "refine", fields,
      [](RefineOptions options, const Rigid3& start, const std::vector<Match>& matches,
         const std::vector<Blob>& blobs, const Scene& scene, const std::optional<Prior>& prior) {
        options.prior = prior;
        py::gil_scoped_release unlocked;
        return refine(start, matches, blobs, scene, options);
      },
      py::arg("start"), py::arg("matches"), py::arg("blobs"), py::arg("scene"),
      py::arg("prior") = py::none(), py::kw_only(),
      ("Computes the maximum-likelihood pose for an assignment of blobs to lamps.\n\n"
       "start: initial cam_from_world (4x4), such as that of a Hypothesis. matches: list of\n"
       "Match. Without the image, Rung.direct falls back to the rims.\n"
       "Returns: Refined; status too_few_lamps, degenerate or not_converged.\n"
       "Raises: ValueError for a match outside its list or a start that is not finite." +
       fields_doc(fields, "Options"))
          .c_str());
}

void define_protection_level(py::module_& m) {
  using P = Result<ProtectionLevel>;
  ResultClass<P> level(m, "ProtectionLevel",
                       R"(Bound of a position's error although lamps may be faulty.

Status: ok; too_few_lamps (the probability of faults that are not monitored reaches the risk);
no_pose (the position without some lamps differs by more than its threshold). The levels are
infinite unless the status is ok.)");
  define_result(level);
  level
      .def_property_readonly("risk", value_of(&ProtectionLevel::risk),
                             "Probability that an error beyond the level is not detected.")
      .def_property_readonly("horizontal_m", value_of(&ProtectionLevel::horizontal_m),
                             "Level of the horizontal error [m].")
      .def_property_readonly("vertical_m", value_of(&ProtectionLevel::vertical_m),
                             "Level of the error along the world's z axis [m].")
      .def_property_readonly("unmonitored", value_of(&ProtectionLevel::unmonitored),
                             "Probability of faults that are not monitored, with that of a wrong "
                             "assignment (Fix.risk).")
      .def_property_readonly("hypotheses", value_of(&ProtectionLevel::hypotheses),
                             "Number of monitored sets of faulty lamps.")
      .def_property_readonly("contradicting_lamps", value_of(&ProtectionLevel::contradicting_lamps),
                             "Ids of the lamps with the largest separation beyond its threshold.")
      .def("__repr__", [](const P& p) {
        return "<ProtectionLevel: " + std::string(to_string(p.status)) + ", horizontal " +
               value_repr(p.value.horizontal_m) + " m, vertical " + value_repr(p.value.vertical_m) +
               " m>";
      });
}

void define_fix(py::module_& m) {
  using C = Candidate;
  ResultClass<C>(m, "Candidate", "One plausible pose.")
      .def_readonly("cam_from_world", &C::cam_from_world, "Pose, 4x4.")
      .def_readonly("covariance", &C::covariance,
                    "(6, 6) of cam_from_world [rotation rad, translation m], left perturbation.")
      .def_readonly("position_m", &C::position_m, "(3,) position of the camera [m, world].")
      .def_property_readonly(
          "position_covariance_m2",
          [](const C& c) { return position_covariance(c.cam_from_world, c.covariance); },
          "(3, 3) covariance of the position [m^2, world].")
      .def_readonly("variance_factor", &C::variance_factor,
                    "Factor that the covariance contains because residuals exceed their sigmas.")
      .def_readonly("estimated_map_sigma_m", &C::estimated_map_sigma_m,
                    "Estimated standard deviation of errors of the lamps' positions [m] if lamps "
                    "that are stated as exact contradict each other, else None.")
      .def_readonly("estimated_size_sigma", &C::estimated_size_sigma,
                    "The same for relative errors of the lamps' sizes, if the sizes of their "
                    "images contradict their directions, else None.")
      .def_readonly("estimated_growth_px", &C::estimated_growth_px,
                    "The same for a growth of all outlines by as many pixels, as by a response of "
                    "the camera that is not stated, else None.")
      .def_readonly("estimated_camera", &C::estimated_camera,
                    "Camera with the estimated errors of its parameters, if the scene states such "
                    "errors, or if its lamps contradict each other as with a wrong focal length or "
                    "k1; else None.")
      .def_readonly("rms_px", &C::rms_px,
                    "Root mean square centre residual over lamps whose blobs are not merged [px].")
      .def_readonly("chi2", &C::chi2, "Robust chi-square of lamps and prior.")
      .def_readonly("dof", &C::dof, "Observations minus parameters.")
      .def_readonly("probability", &C::probability,
                    "locate(): probability that this pose is right, among all candidates and "
                    "\"none of them\"; or None.")
      .def_readonly("lamps", &C::lamps, "Lamp id -> Blob.")
      .def("__repr__", [](const C& c) {
        return "<Candidate: position " + rounded(c.position_m, 4) + " m, lamps " +
               keys_text(c.lamps) + ", rms " + value_repr(c.rms_px) + " px>";
      });

  ResultClass<Timing>(m, "Timing", "Computing times [s].")
      .def_readonly("detect_s", &Timing::detect_s, "Detection of blobs [s].")
      .def_readonly("identify_s", &Timing::identify_s, "Identification of lamps [s].")
      .def_readonly("refine_s", &Timing::refine_s, "Refinement of poses [s].")
      .def_readonly("total_s", &Timing::total_s, "Whole call [s].")
      .def("__repr__", [](const Timing& t) { return "<Timing: " + value_repr(t.total_s) + " s>"; });

  define_protection_level(m);
  using R = Result<Fix>;
  ResultClass<R> fix(m, "Fix", R"(Pose of the camera: result of locate() and solve_pose().

If `ok` is false, status and message state the reason; the fix then holds what was found so far.
Without candidates, the pose is undefined and its covariance infinite.)");
  define_result(fix);
  fix.def_property_readonly("position_m", value_of(&Fix::position_m),
                            "(3,) position of the camera [m, world].")
      .def_property_readonly("position_covariance_m2", value_of(&Fix::position_covariance_m2),
                             "(3, 3) covariance of the position [m^2, world].")
      .def_property_readonly("cam_from_world", value_of(&Fix::cam_from_world), "Pose, 4x4.")
      .def_property_readonly(
          "covariance", value_of(&Fix::covariance),
          "(6, 6) of cam_from_world [rotation rad, translation m], left perturbation.")
      .def_property_readonly("candidates", value_of(&Fix::candidates),
                             "List of Candidate: all plausible poses, best first; the first is "
                             "the fix.")
      .def_property_readonly("lamps", value_of(&Fix::lamps),
                             "Lamp id -> Blob, of the best candidate.")
      .def_property_readonly("blobs", value_of(&Fix::blobs), "List of all detected Blobs.")
      .def_property_readonly(
          "rms_px", value_of(&Fix::rms_px),
          "Root mean square centre residual over lamps whose blobs are not merged [px].")
      .def_property_readonly(
          "risk", value_of(&Fix::risk),
          "Probability that the pose is wrong, because another one is right or, in "
          "locate() and robust_pose(), because it is accidental; 1 without "
          "candidates; None if no other pose was searched.")
      .def_property_readonly("cut_short", value_of(&Fix::cut_short),
                             "locate(): the search for poses stopped early, at the budget or at "
                             "max_hypotheses.")
      .def_property_readonly("found_colour", value_of(&Fix::found_colour),
                             "locate(): colour of the lamps that was found in the image, where the "
                             "scene states none and the blobs of all colours gave no pose: (3,) "
                             "shares of red, green and blue over the largest; or None.")
      .def_property_readonly("taken_as_exact", value_of(&Fix::taken_as_exact),
                             "locate(): \"camera\" and \"map\" if the scene states no error of "
                             "them. Where such a part is not exact, the pose can be off by many "
                             "of its sigmas.")
      .def_property_readonly("circles", value_of(&Fix::circles),
                             "locate(): without candidates, in an image of one or two blobs: "
                             "PoseCircles that one disc allows.")
      .def_property_readonly("excluded_lamps", value_of(&Fix::excluded_lamps),
                             "locate(): ids of lamps that contradict the others; the pose does "
                             "not depend on them.")
      .def(
          "protection_level_m",
          [](const R& fix, double risk, double continuity_risk) {
            return fix->protection_level_m(risk, continuity_risk);
          },
          py::arg("risk") = 1e-7, py::arg("continuity_risk") = 1e-3,
          R"(Computes a bound of the position's error by solution separation.

risk: probability that an error beyond the bound is not detected. continuity_risk: probability that
a test rejects an image without faults. Each lamp may be faulty with the probability
lamp_fault_probability of locate(). Returns: ProtectionLevel. Raises: ValueError for a probability
that is not between 0 and 1.)")
      .def_property_readonly("timing_s", value_of(&Fix::timing_s), "Timing: computing times [s].")
      .def_property_readonly("choice", value_of(&Fix::choice),
                             "RungChoice of locate(): rung of the refinement, with the reason; or "
                             "None.")
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
          field("max_candidates", &O::max_candidates,
                "maximum number of poses that are refined and returned"),
          field("max_risk", &O::max_risk,
                "status ok if the pose is wrong with at most this probability"),
          field("lamp_fault_probability", &O::lamp_fault_probability,
                "probability that a lamp is moved, misnamed or a reflection, for the protection "
                "level"),
          field("budget_s", &O::budget_s, "time budget of the whole call [s]; selects the rung"),
          field("target_sigma_m", &O::target_sigma_m,
                "target for the position's error [m]; selects the rung"),
          field("costs", &O::costs, "RungCosts of this machine")),
      fields_within(&O::detect, detect_fields()), fields_within(&O::identify, identify_fields()),
      fields_within(&O::refine, refine_fields()));
}

void define_locate_function(py::module_& m) {
  const auto fields = locate_fields();
  const std::string doc =
      R"(Computes the camera's pose from one image of the scene's lamps.

Detects blobs, assigns them to lamps, solves for the pose and refines it.
image: (height, width) or (height, width, 3 or 4) array of uint8 or uint16, of the camera's size;
not copied when the pixels of a row are adjacent. Channels are red, green, blue; they are compared
with the lamps' colours if the scene states any. Instead of the image, a list of Blobs from
detect(). scene: Scene. prior: Prior or None.
budget_s: selects the most accurate rung that is predicted to fit into the time left after detection
and identification. target_sigma_m: root of the trace of the position's covariance; selects the
fastest rung that is predicted to meet it, within the budget if both are given. Each replaces `rung`.
If no rung meets them, the status is budget_not_met and the fix is the best possible one.
Returns: Fix; check `ok` or `status` before using it. `candidates` holds all plausible poses, `choice`
the selected rung with the reason.
Raises: TypeError or ValueError for an unsupported array, an image that does not have the camera's
size, or an option out of range.)" +
      fields_doc(fields, "Options");

  define_function(
      m, "locate", fields,
      [](LocateOptions options, const ImageOrBlobs& given, const Scene& scene,
         const std::optional<Prior>& prior) {
        options.prior = prior;
        py::gil_scoped_release unlocked;
        return given.image ? locate(given.image->view, scene, options)
                           : locate(given.blobs, scene, options);
      },
      py::arg("image"), py::arg("scene"), py::arg("prior") = py::none(), py::kw_only(),
      doc.c_str());
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
