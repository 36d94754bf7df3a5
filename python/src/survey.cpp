// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/survey.hpp"

#include "fields.hpp"
#include "libocc/decode/track_blobs.hpp"
#include "module.hpp"
#include "results.hpp"
#include "survey_input.hpp"

namespace occ::python {
namespace {

using Surveyed = Result<Survey>;
using Places = std::vector<std::optional<Eigen::Vector3d>>;
using ImuRows = Eigen::Matrix<double, Eigen::Dynamic, 7>;
using Distances = std::vector<std::tuple<int, int, double, double>>;

auto survey_fields() {
  using O = SurveyOptions;
  return std::tuple_cat(
      survey_motion_fields(),
      std::make_tuple(
          field("max_log10_false_alarms", &O::max_log10_false_alarms,
                "limit of the number of accidental matches as good, base-10 logarithm")),
      survey_error_fields(),
      std::make_tuple(field("calibrate_camera", &O::calibrate_camera,
                            "estimates the camera's parameters that are not exact along, with "
                            "their sigmas as priors (Survey.camera)"),
                      field("radius_m", &O::radius_m, "radius of all discs; determines the scale"),
                      field("radius_sigma", &O::radius_sigma, "its relative standard deviation"),
                      field("odometry_sigma", &O::odometry_sigma,
                            "relative sigma of a path's length by odometry"),
                      field("tag_size_m", &O::tag_size_m,
                            "side of the tags' black square; determines the scale")),
      survey_thread_fields());
}

/// The network before the rejection of gross errors, for an adjustment that reports them.
Network with_all_observations(const Surveyed& survey) {
  Network network = survey->adjustment.network;
  for (ImageObservation& observation : network.observations) observation.used = true;
  for (DistanceObservation& distance : network.distances) distance.used = true;
  return network;
}

void define_results(py::module_& m) {
  py::native_enum<SurveyScale>(m, "SurveyScale", "enum.Enum", "Origin of the scale of a survey.")
      .value("free", SurveyScale::free)
      .value("distances", SurveyScale::distances)
      .value("radius", SurveyScale::radius)
      .value("tags", SurveyScale::tags)
      .value("odometry", SurveyScale::odometry)
      .value("imu", SurveyScale::imu)
      .finalize();
  ResultClass<SurveyedLamp>(m, "SurveyedLamp", "A lamp of a survey.")
      .def_readonly("lamp", &SurveyedLamp::lamp,
                    "Lamp with position, shape, size, normal, relative power and colour.")
      .def_readonly("pictures", &SurveyedLamp::pictures, "Number of pictures with an observation.")
      .def_readonly("has_power", &SurveyedLamp::has_power,
                    "False: saturated in all pictures; its power is then 1.")
      .def_readonly("has_shape", &SurveyedLamp::has_shape,
                    "False: no measured rim; the lamp is a point.")
      .def_readonly("code_id", &SurveyedLamp::code_id,
                    "Id that it transmits (Blob.lamp_id), or None.");
  ResultClass<SurveyOmission>(m, "SurveyOmission", "A blob or picture that a survey does not use.")
      .def_readonly("picture", &SurveyOmission::picture, "Name of the picture.")
      .def_readonly("blob", &SurveyOmission::blob, "Index of the blob; -1: the whole picture.")
      .def_readonly("reason", &SurveyOmission::reason, "Reason, a sentence.");
  ResultClass<InertialAlignment>(m, "InertialAlignment",
                                 "Alignment of an inertial measurement unit with a survey.")
      .def_readonly("scale_sigma", &InertialAlignment::scale_sigma, "Relative sigma of the scale.")
      .def_readonly("down", &InertialAlignment::down, "(3,) direction of gravity in the map.")
      .def_readonly("cam_from_imu", &InertialAlignment::cam_from_imu,
                    "(3, 3) axes of the unit in the camera's frame.")
      .def_readonly("time_offset_s", &InertialAlignment::time_offset_s,
                    "Time of the unit's clock minus that of the pictures [s].")
      .def_readonly("turn_rate_bias_rad_s", &InertialAlignment::turn_rate_bias_rad_s,
                    "(3,) bias of the gyroscope [rad/s].")
      .def_readonly("contradictions", &InertialAlignment::contradictions,
                    "Pictures after which a turn contradicts the others; the measurements up to "
                    "the next are not used.");
  ResultClass<Surveyed> survey(m, "Survey", "Map of lamps made from pictures; see survey().");
  define_result(survey);
  survey.def_property_readonly("lamps", value_of(&Survey::lamps), "SurveyedLamps by id.")
      .def_property_readonly("image_of_picture", value_of(&Survey::image_of_picture),
                             "Image of the network for each picture; -1: not used.")
      .def_property_readonly("lamp_of_blob", value_of(&Survey::lamp_of_blob),
                             "Id of the lamp of each blob of each picture; -1: none.")
      .def_property_readonly("omissions", value_of(&Survey::omissions),
                             "SurveyOmissions: all that is not used, with the reason.")
      .def_property_readonly("scale", value_of(&Survey::scale), "Origin of the scale.")
      .def_property_readonly(
          "scale_sigma", value_of(&Survey::scale_sigma),
          "Relative sigma of a scale by radius, tags, odometry or imu, beside the precision.")
      .def_property_readonly("inertial", value_of(&Survey::inertial),
                             "InertialAlignment if the scale is that of imu, else None.")
      .def_property_readonly("model_sigma_px", value_of(&Survey::model_sigma_px),
                             "Estimated sigma, per axis, of the errors of a lamp's image beyond "
                             "its noise.")
      .def_property_readonly("camera", value_of(&Survey::camera),
                             "Camera of the call, or with estimated parameters and covariance.")
      .def_property_readonly("warnings", value_of(&Survey::warnings), "Contradictions to check.");
  survey
      .def_property_readonly(
          "network", [](const Surveyed& s) { return s->adjustment.network; },
          "Adjusted network; points are named \"lamp 7\", images as the pictures.")
      .def_property_readonly("network_with_all_observations", &with_all_observations,
                             "The network with the rejected observations in use again.")
      .def_property_readonly(
          "sigma0", [](const Surveyed& s) { return s->adjustment.sigma0; },
          "A posteriori standard deviation of unit weight.")
      .def_property_readonly(
          "redundancy", [](const Surveyed& s) { return s->adjustment.redundancy; },
          "observations - unknowns + defect.");
}

/// Track of each blob of each frame.
std::vector<std::vector<int>> tracks_of(
    const std::vector<std::pair<double, std::vector<Blob>>>& frames, const TrackOptions& options) {
  std::vector<FrameBlobs> all;
  std::vector<std::vector<int>> numbers;
  for (const auto& [time_s, blobs] : frames) {
    all.push_back({time_s, blobs});
    numbers.emplace_back(blobs.size(), -1);
  }
  const std::vector<Track> tracks = track_blobs(all, options);
  for (std::size_t t = 0; t < tracks.size(); ++t)
    for (const TrackPoint& point : tracks[t].points)
      if (point.blob) numbers[point.frame][*point.blob] = static_cast<int>(t);
  return numbers;
}

auto track_fields() {
  using O = TrackOptions;
  return std::make_tuple(
      field("gate_sigma", &O::gate_sigma, "largest distance of blob and prediction [sigma]"),
      field("position_sigma_px", &O::position_sigma_px, "added to the sigma of a blob"),
      field("speed_sigma_px_s", &O::speed_sigma_px_s, "initial sigma of a velocity component"),
      field("acceleration_px_s2", &O::acceleration_px_s2, "sigma of the acceleration noise"),
      field("max_gap_s", &O::max_gap_s, "largest time between two blobs of a track"));
}

}  // namespace

void define_survey(py::module_& m) {
  define_results(m);
  const auto options_of_tracks = track_fields();
  const std::string track_doc =
      "Joins the blobs of each lamp over the frames of a recording, by a Kalman filter per "
      "lamp.\n\n"
      "frames: (time [s], blobs) of each. Returns: for each frame, the number of the track of "
      "each\n"
      "blob; tracks are numbered by their first blobs. A lamp that is not seen for longer than\n"
      "max_gap_s starts a new track. Raises: ValueError for times that do not increase." +
      fields_doc(options_of_tracks, "Options");
  define_function(
      m, "track_blobs", options_of_tracks,
      [](TrackOptions options, const std::vector<std::pair<double, std::vector<Blob>>>& frames) {
        py::gil_scoped_release unlocked;
        return tracks_of(frames, options);
      },
      py::arg("frames"), track_doc.c_str());
  const auto fields = survey_fields();
  const std::string doc =
      "Maps lamps from pictures of one calibrated camera at unknown places.\n\n"
      "pictures: (name, blobs) of each. distances: (lamp id, lamp id, length, sigma) [m]; they\n"
      "determine the scale. tags: AprilTags of each picture, which link pictures, and determine\n"
      "the scale with tag_size_m. tracks: for each picture, the\n"
      "track of each blob in a recording, or -1: blobs of one track are one lamp. times_s:\n"
      "exposure of the middle row of each, or None. odometry_m: position (3,) of the camera by\n"
      "odometry for each picture, or None; consecutive ones determine the scale if nothing else "
      "does.\n"
      "imu: (n, 7) samples of a unit fixed to the camera: time [s], rotation rates [rad/s],\n"
      "specific forces [m/s^2]; they determine the scale of pictures with times_s if nothing else\n"
      "does. Axes and clock of the unit are estimated.\n"
      "progress(stage, done, total): called often; False stops it. Returns: Survey; status "
      "too_few_lamps, ambiguous, no_pose, or that of\n"
      "the adjustment. Raises: ValueError for an invalid option or an unknown lamp." +
      fields_doc(fields, "Options");
  define_function(
      m, "survey", fields,
      [](SurveyOptions options, const SurveyBlobs& pictures, const Camera& camera,
         const Distances& distances, const SurveyTags& tags, const SurveyTracks& tracks,
         const SurveyTimes& times_s, const Places& odometry_m, const ImuRows& imu,
         const py::object& progress) {
        std::vector<SurveyPicture> all = survey_pictures(pictures, tags, tracks, times_s);
        for (const auto& [from, to, length_m, sigma_m] : distances)
          options.distances.push_back({from, to, length_m, sigma_m});
        require(odometry_m.empty() || odometry_m.size() == all.size(), "odometry_m",
                odometry_m.size(), "one position for each picture");
        for (std::size_t i = 0; i < odometry_m.size(); ++i) all[i].odometry_m = odometry_m[i];
        for (Eigen::Index k = 0; k < imu.rows(); ++k)
          options.imu.push_back({imu(k, 0), imu.row(k).segment<3>(1), imu.row(k).tail<3>()});
        const SurveyCallback callback = survey_callback(progress);
        py::gil_scoped_release unlocked;
        return survey(all, camera, options, callback);
      },
      py::arg("pictures"), py::arg("camera"), py::kw_only(),
      py::arg_v("distances", Distances{}, "[]"), py::arg_v("tags", SurveyTags{}, "[]"),
      py::arg_v("tracks", SurveyTracks{}, "[]"), py::arg_v("times_s", SurveyTimes{}, "[]"),
      py::arg_v("odometry_m", Places{}, "[]"), py::arg_v("imu", ImuRows(0, 7), "zeros((0, 7))"),
      py::arg("progress") = py::none(), doc.c_str());
}

}  // namespace occ::python
