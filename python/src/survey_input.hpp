// SPDX-License-Identifier: Apache-2.0
// Arguments that survey() and update_map() share.
#pragma once

#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "fields.hpp"
#include "libocc/core/require.hpp"
#include "libocc/survey/survey.hpp"
#include "progress.hpp"

namespace occ::python {

using SurveyBlobs = std::vector<std::pair<std::string, std::vector<Blob>>>;  ///< (name, blobs)
using SurveyTags = std::vector<std::vector<AprilTag>>;
using SurveyTracks = std::vector<std::vector<int>>;
using SurveyTimes = std::vector<std::optional<double>>;

inline auto survey_motion_fields() {
  using O = SurveyOptions;
  return std::make_tuple(
      field("ordered", &O::ordered, "consecutive pictures are neighbours of one motion"),
      field("max_motion_rad", &O::max_motion_rad,
            "ordered: largest median change of the lamps' directions between neighbours"),
      field("row_time_s", &O::row_time_s,
            "ordered, with times_s: time between the exposures of two rows"));
}

inline auto survey_error_fields() {
  using O = SurveyOptions;
  return std::make_tuple(
      field("size_spread", &O::size_spread,
            "relative sigma of the differences of the lamps' sizes, for start values"),
      field(
          "model_sigma_px", &O::model_sigma_px,
          "sigma of errors of a lamp's image beyond its noise; estimated if the redundancy is 20"));
}

inline auto survey_thread_fields() {
  return std::make_tuple(
      field("threads", &SurveyOptions::threads, "at least 1; any number gives the same bits"));
}

/// Raises ValueError unless there are no tags, tracks or times, or an entry for each picture.
inline std::vector<SurveyPicture> survey_pictures(const SurveyBlobs& pictures,
                                                  const SurveyTags& tags,
                                                  const SurveyTracks& tracks,
                                                  const SurveyTimes& times_s) {
  std::vector<SurveyPicture> all;
  for (const auto& [name, blobs] : pictures) all.push_back({name, blobs});
  require(tags.empty() || tags.size() == all.size(), "tags", tags.size(),
          "one list for each picture");
  for (std::size_t i = 0; i < tags.size(); ++i) all[i].tags = tags[i];
  require(tracks.empty() || tracks.size() == all.size(), "tracks", tracks.size(),
          "one list for each picture");
  for (std::size_t i = 0; i < tracks.size(); ++i) all[i].tracks = tracks[i];
  require(times_s.empty() || times_s.size() == all.size(), "times_s", times_s.size(),
          "one time for each picture");
  for (std::size_t i = 0; i < times_s.size(); ++i) all[i].time_s = times_s[i];
  return all;
}

inline SurveyCallback survey_callback(const py::object& progress) {
  return [&progress](const SurveyProgress& state) {
    return report_progress(progress, state.stage, state.done, state.total);
  };
}

}  // namespace occ::python
