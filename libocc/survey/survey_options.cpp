// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>

#include "libocc/core/require.hpp"
#include "libocc/survey/internal/growing_map.hpp"
#include "libocc/survey/survey.hpp"

namespace occ {

void SurveyOptions::validate() const {
  require_positive(max_motion_rad, "max_motion_rad");
  require(std::isfinite(max_log10_false_alarms), "max_log10_false_alarms", max_log10_false_alarms,
          "finite");
  require_not_negative(row_time_s, "row_time_s");
  require_positive(size_spread, "size_spread");
  require_positive(model_sigma_px, "model_sigma_px");
  require_positive(radius_sigma, "radius_sigma");
  require_positive(odometry_sigma, "odometry_sigma");
  require(threads >= 1, "threads", threads, "at least 1");
  if (radius_m) {
    require_positive(*radius_m, "radius_m");
    require(distances.empty() && !tag_size_m, "radius_m", *radius_m,
            "omitted if distances or tag_size_m are given");
  }
  if (tag_size_m) {
    require_positive(*tag_size_m, "tag_size_m");
    require(distances.empty(), "tag_size_m", *tag_size_m, "omitted if distances are given");
  }
  for (std::size_t i = 0; i < imu.size(); ++i) {
    const std::string name = "imu[" + std::to_string(i) + "]";
    require(std::isfinite(imu[i].time_s) && (i == 0 || imu[i].time_s > imu[i - 1].time_s),
            name + ".time_s", imu[i].time_s, "finite, and after that of the sample before");
    require(imu[i].turn_rate_rad_s.allFinite(), name + ".turn_rate_rad_s",
            imu[i].turn_rate_rad_s.transpose(), "finite");
    require(imu[i].acceleration_m_s2.allFinite(), name + ".acceleration_m_s2",
            imu[i].acceleration_m_s2.transpose(), "finite");
  }
  for (std::size_t i = 0; i < distances.size(); ++i) {
    const std::string name = "distances[" + std::to_string(i) + "]";
    require(distances[i].from >= 0, name + ".from", distances[i].from, "at least 0");
    require(distances[i].to >= 0 && distances[i].to != distances[i].from, name + ".to",
            distances[i].to, "at least 0 and another lamp than from");
    require_positive(distances[i].length_m, name + ".length_m");
    require_positive(distances[i].sigma_m, name + ".sigma_m");
  }
}

void internal::survey::check_input(const std::vector<SurveyPicture>& pictures, const Camera& camera,
                                   const SurveyOptions& options) {
  options.validate();
  for (const SurveyPicture& picture : pictures) {
    require(picture.tracks.empty() || picture.tracks.size() == picture.blobs.size(),
            picture.name + ": tracks", picture.tracks.size(), "one for each blob");
    if (picture.odometry_m)
      require(picture.odometry_m->allFinite(), picture.name + ": odometry_m",
              picture.odometry_m->transpose(), "finite");
  }
  require(camera.is_central(), "camera", name_of(camera.kind()),
          "one with a single projection centre");
  require(!options.calibrate_camera || !camera.is_exact(), "calibrate_camera", "true",
          "used with a camera that states errors of its parameters");
}

}  // namespace occ
