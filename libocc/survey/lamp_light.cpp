// SPDX-License-Identifier: Apache-2.0
#include "libocc/survey/internal/lamp_light.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/statistics.hpp"
#include "libocc/scene/internal/lamp_emission.hpp"

namespace occ::internal::survey {

using Eigen::Vector3d;

LampSignal lamp_signal(const std::vector<BlobInPicture>& blobs) {
  LampSignal signal;
  std::vector<double> frequencies, sigmas;
  bool contradicts = false;
  for (const BlobInPicture& one : blobs) {
    if (one.blob->lamp_id) {
      contradicts = contradicts || (signal.id && *signal.id != *one.blob->lamp_id);
      signal.id = one.blob->lamp_id;
    }
    if (one.blob->frequency_hz && std::isfinite(one.blob->frequency_sigma_hz)) {
      frequencies.push_back(*one.blob->frequency_hz);
      sigmas.push_back(one.blob->frequency_sigma_hz);
    }
  }
  if (contradicts) signal.id.reset();
  signal.frequency_hz = median(std::move(frequencies));
  signal.frequency_sigma_hz = median(std::move(sigmas));
  return signal;
}

RelativeLight lamp_light(const Lamp& lamp, const std::vector<BlobInPicture>& blobs) {
  std::vector<double> powers;
  Vector3d colour = Vector3d::Zero();
  int colours = 0;
  const scene::LampEmission emitted(lamp);
  for (const auto& [blob, pose] : blobs) {
    const Vector3d in_cam = pose * lamp.centre_m;
    const double emission = -(pose.rotation * lamp.normal).dot(in_cam) / in_cam.norm();
    const double incidence = in_cam.z() / in_cam.norm();
    const Vector3d to_eye = pose.origin_in_source() - lamp.centre_m;
    constexpr double min_cosine = 0.1;  // the quotient is inaccurate towards zero
    if (!blob->saturated && emission > min_cosine && incidence > min_cosine &&
        emitted.intensity(1, to_eye, emission) > 0)
      powers.push_back(blob->flux_dn * in_cam.squaredNorm() /
                       (emitted.intensity(1, to_eye, emission) * incidence));
    if (blob->colour && !blob->colour->clipped[0] && !blob->colour->clipped[1] &&
        !blob->colour->clipped[2]) {
      colour += 3 * blob->colour->share;
      ++colours;
    }
  }
  RelativeLight light;
  if (colours > 0) light.colour = colour / colours;
  if (powers.empty()) return light;
  light.power = median(powers);
  std::vector<double> deviations;
  for (const double power : powers) deviations.push_back(std::abs(power / *light.power - 1));
  constexpr double sigma_over_deviation = 1.4826;  // median absolute deviation of a normal variable
  light.power_sigma =
      sigma_over_deviation * median(deviations) / std::sqrt(static_cast<double>(powers.size()));
  return light;
}

void normalise_power(std::vector<SurveyedLamp>& lamps) {
  double sum = 0;
  int count = 0;
  for (const SurveyedLamp& lamp : lamps)
    if (lamp.has_power) {
      sum += lamp.lamp.power_w;
      ++count;
    }
  for (SurveyedLamp& lamp : lamps)
    if (lamp.has_power && sum > 0) lamp.lamp.power_w *= count / sum;
}

}  // namespace occ::internal::survey
