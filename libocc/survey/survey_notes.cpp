// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/survey_notes.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace occ::internal::survey {

void note_growth(Survey& survey) {
  constexpr double min_growth_px = 0.15;  // three times the error of a known response
  const double growth = survey.adjustment.network.cameras[0].outline_growth_px;
  if (std::abs(growth) < min_growth_px) return;
  std::ostringstream text;
  text.precision(2);
  text << "the rims of all lamps are " << std::abs(growth) << " px too "
       << (growth > 0 ? "large" : "small")
       << ", which the map allows for: improve exposure or focus, or state the response of the "
          "camera (sensor.response)";
  survey.warnings.push_back(text.str());
}

void note_contradictions(Survey& survey) {
  constexpr double max_model_sigma_px = 0.04;  // twice that of rendered and real pictures
  constexpr double max_rejected_share = 0.1;   // single blobs are disturbed, such as by reflections
  constexpr double max_sigma0 = 2;
  const Adjustment& adjusted = survey.adjustment;
  const double rejected_share = static_cast<double>(adjusted.rejected.size()) /
                                static_cast<double>(adjusted.network.observations.size());
  if (survey.model_sigma_px <= max_model_sigma_px && rejected_share <= max_rejected_share &&
      adjusted.sigma0 <= max_sigma0)
    return;
  std::ostringstream text;
  text.precision(2);
  text << "the pictures contradict each other: the lamps' images differ by "
       << survey.model_sigma_px << " px beyond the noise, residuals are " << adjusted.sigma0
       << " times the expected ones, and " << 100 * rejected_share
       << " % of the images are rejected; check that the camera's calibration is that of the "
          "pictures, because its errors displace lamps, and take more pictures";
  survey.warnings.push_back(text.str());
}

void note_left_out(Survey& survey) {
  for (const LeftOut& one : survey.adjustment.left_out) {
    if (one.kind != LeftOut::Kind::station) continue;
    std::replace(survey.image_of_picture.begin(), survey.image_of_picture.end(), one.index, -1);
    survey.omissions.push_back(
        {survey.adjustment.network.stations[one.index].name, -1, "it " + one.reason});
  }
}

}  // namespace occ::internal::survey
