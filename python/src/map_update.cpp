// SPDX-License-Identifier: Apache-2.0
#include "fields.hpp"
#include "libocc/survey/update.hpp"
#include "module.hpp"
#include "results.hpp"
#include "survey_input.hpp"

namespace occ::python {
namespace {

using Updated = Result<MapUpdate>;

auto update_fields() {
  using O = UpdateOptions;
  const auto own = std::make_tuple(
      field("map_sigma_m", &O::map_sigma_m,
            "sigma, per axis, of the places of lamps whose errors the map does not state"),
      field("false_alarm", &O::false_alarm,
            "probability that a lamp that did not change is reported, for each test"),
      field("max_move_m", &O::max_move_m,
            "maximum displacement of a lamp that keeps its id without a code"),
      field("min_gone_pictures", &O::min_gone_pictures,
            "minimum number of pictures that should show a lamp that is gone"),
      field("max_log10_false_alarms", &O::max_log10_false_alarms,
            "limit of the number of accidental links as good, base-10 logarithm"));
  const auto survey =
      std::tuple_cat(survey_motion_fields(), survey_error_fields(), survey_thread_fields());
  return std::tuple_cat(own, fields_within(&O::survey, survey));
}

void define_lamp_updates(py::module_& m) {
  py::native_enum<LampFate>(m, "LampFate", "enum.Enum", "Verdict about a lamp of a map.")
      .value("unchanged", LampFate::unchanged)
      .value("changed", LampFate::changed)
      .value("moved", LampFate::moved)
      .value("gone", LampFate::gone)
      .value("not_seen", LampFate::not_seen)
      .value("added", LampFate::added)
      .finalize();
  ResultClass<LampChange>(m, "LampChange", "A quantity of a lamp that differs from the map.")
      .def_readonly("quantity", &LampChange::quantity, "shape, size, normal, power or colour.")
      .def_readonly("before", &LampChange::before, "Value in the map, as text.")
      .def_readonly("after", &LampChange::after, "Measured value, as text.")
      .def_readonly("statistic", &LampChange::statistic,
                    "Difference over its standard deviation; of a shape 0.");
  using U = LampUpdate;
  ResultClass<U>(m, "LampUpdate", "Verdict about one lamp, with its evidence.")
      .def_readonly("fate", &U::fate, "LampFate.")
      .def_readonly("lamp", &U::lamp, "Lamp after the update; gone: as in the map.")
      .def_readonly("reason", &U::reason, "Evidence for the verdict, a sentence.")
      .def_readonly("covariance_m2", &U::covariance_m2, "(3, 3) of lamp.centre_m.")
      .def_readonly("old_centre_m", &U::old_centre_m, "(3,) place in the map.")
      .def_readonly("has_test", &U::has_test,
                    "True: the place was measured, and the next four values are set.")
      .def_readonly("displacement_m", &U::displacement_m, "(3,) measured place minus map.")
      .def_readonly("displacement_covariance_m2", &U::displacement_covariance_m2,
                    "(3, 3) with the errors of map, pictures and link.")
      .def_readonly("displacement_sigma_m", &U::displacement_sigma_m,
                    "Standard deviation of the displacement's length.")
      .def_readonly("statistic", &U::statistic,
                    "Chi-square of the displacement, 3 degrees of freedom.")
      .def_readonly("seen", &U::seen, "Indices of the pictures that show it.")
      .def_readonly("missed", &U::missed, "Indices of the pictures that should and do not.")
      .def_readonly("changes", &U::changes, "LampChanges beside the place.");
}

void define_update_results(py::module_& m) {
  define_lamp_updates(m);
  using W = MapWay;
  ResultClass<W>(m, "MapWay", "A way to link pictures to a map.")
      .def_readonly("picture", &W::picture, "First picture of the constellation.")
      .def_readonly("cam_from_world", &W::cam_from_world, "(4, 4) its pose.")
      .def_readonly("matches", &W::matches, "Number of lamps at places of the map.")
      .def_readonly("lamps", &W::lamps, "Number of lamps of the constellation.")
      .def_readonly("missing", &W::missing,
                    "Number of lamps of the map that pictures should show and do not.")
      .def_readonly("log10_false_alarms", &W::log10_false_alarms,
                    "log10 of the expected number of accidental ways as good.")
      .def_readonly("prior_chi2", &W::prior_chi2,
                    "Chi-square of the prior of the first picture; None without it.")
      .def_readonly("lamp_ids", &W::lamp_ids, "Ids of the lamps of the map that match.");
  ResultClass<Updated> update(m, "MapUpdate",
                              "Comparison of a map with pictures; see update_map().");
  define_result(update);
  update
      .def_property_readonly("lamps", value_of(&MapUpdate::lamps),
                             "LampUpdates: lamps of the map in its order, then new ones.")
      .def_property_readonly("covariance_m2", value_of(&MapUpdate::covariance_m2),
                             "(3n, 3n) of the places of all lamps that are not gone.")
      .def_property_readonly("cam_from_world", value_of(&MapUpdate::cam_from_world),
                             "(4, 4) pose of each picture; None: not used.")
      .def_property_readonly("ways", value_of(&MapUpdate::ways),
                             "MapWays that are plausible, best first.")
      .def_property_readonly("omissions", value_of(&MapUpdate::omissions),
                             "SurveyOmissions: all that is not used, with the reason.")
      .def_property_readonly("warnings", value_of(&MapUpdate::warnings),
                             "Contradictions and assumptions to check.")
      .def_property_readonly("max_statistic", value_of(&MapUpdate::max_statistic),
                             "Limit of LampUpdate.statistic.")
      .def_property_readonly("changed_share", value_of(&MapUpdate::changed_share),
                             "Moved and gone lamps over those of the map that pictures show.");
}

}  // namespace

void define_map_update(py::module_& m) {
  define_update_results(m);
  const auto fields = update_fields();
  const std::string doc =
      "Compares a map of lamps with new pictures by the scene's camera.\n\n"
      "pictures: (name, blobs) of each. prior: of the first picture's camera; it decides between\n"
      "several ways to link the pictures to a regular map. tags: AprilTags of each picture, which\n"
      "link pictures; their sizes are not used. tracks, times_s: as for survey().\n"
      "progress(stage, done, total): called often; False stops it.\n"
      "Returns: MapUpdate; status too_few_lamps, ambiguous, no_pose, or as survey().\n"
      "Raises: ValueError for an invalid option or scene." +
      fields_doc(fields, "Options");
  define_function(
      m, "update_map", fields,
      [](UpdateOptions options, const SurveyBlobs& pictures, const Scene& scene,
         const std::optional<Prior>& prior, const SurveyTags& tags, const SurveyTracks& tracks,
         const SurveyTimes& times_s, const py::object& progress) {
        const std::vector<SurveyPicture> all = survey_pictures(pictures, tags, tracks, times_s);
        options.prior = prior;
        const SurveyCallback callback = survey_callback(progress);
        py::gil_scoped_release unlocked;
        return update_map(all, scene, options, callback);
      },
      py::arg("pictures"), py::arg("scene"), py::arg("prior") = py::none(), py::kw_only(),
      py::arg_v("tags", SurveyTags{}, "[]"), py::arg_v("tracks", SurveyTracks{}, "[]"),
      py::arg_v("times_s", SurveyTimes{}, "[]"), py::arg("progress") = py::none(), doc.c_str());
}

}  // namespace occ::python
