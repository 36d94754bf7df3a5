// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/residuals.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "libocc/core/statistics.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"

namespace occ::internal::refine {
namespace {

double rim_rms(const LampObservation& lamp, const Observations& observations, const State& state) {
  LampInCam in_cam = lamp_in_cam(*lamp.lamp, state.cam_from_world);
  if (lamp.errors) in_cam = with_error(in_cam, lamp.error(), state.cam_from_world);
  const double growth_px = observations.grows(lamp) ? state.growth_px : 0;
  const std::vector<double> distances = rim_distances_px(in_cam, lamp, observations);
  if (distances.empty()) return 0;
  double sum = 0;
  for (const double distance : distances) sum += (distance - growth_px) * (distance - growth_px);
  return std::sqrt(sum / static_cast<double>(distances.size()));
}

}  // namespace

void report_residuals(const State& state, const std::vector<Match>& matches,
                      const Observations& observations, const Scene& scene, Rung rung,
                      Refined& refined) {
  double sum = 0, count = 0;
  const bool any_whole =
      std::any_of(observations.lamps.begin(), observations.lamps.end(),
                  [](const LampObservation& lamp) { return !lamp.blob->merged; });
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const LampObservation& lamp = observations.lamps[i];
    LampResidual residual{matches[i]};
    residual.rung = lamp.has_pixels() ? Rung::direct
                    : lamp.has_rim()  ? Rung::rims
                                      : std::min(rung, Rung::centres);
    residual.contradicts = lamp.contradicts;
    residual.misfit = lamp.misfit;
    residual.position_error_m = lamp.error().segment<3>(3);
    residual.size_error = lamp.error()[6];
    const std::optional<Eigen::Vector2d> centre =
        predicted_centroid_px(*lamp.lamp, state.cam_from_world, scene.camera, rung);
    const auto centroid =
        predicted_centroid_px(*lamp.lamp, *lamp.blob, state.cam_from_world, scene, rung);
    double centre_error = 0;
    if (centre) {
      residual.centre_px = *centre;
      if (lamp.has_centroid)
        centre_error = scene.camera.difference_px(lamp.blob->centroid_px, *centroid).norm();
    }
    residual.rms_px = lamp.has_rim() ? rim_rms(lamp, observations, state) : centre_error;
    const bool by_rim = !lamp.has_centroid || (lamp.has_rim() && lamp.blob->has_hidden_sides());
    const double of_lamp = by_rim ? residual.rms_px : centre_error;
    refined.lamps.push_back(residual);
    if (any_whole && lamp.blob->merged) continue;
    sum += of_lamp * of_lamp;
    ++count;
  }
  if (count > 0) refined.rms_px = std::sqrt(sum / count);
}

double typical_growth_px(const State& state, const Observations& observations) {
  std::vector<double> distances;
  for (const LampObservation& lamp : observations.lamps) {
    if (!observations.grows(lamp)) continue;
    const LampInCam in_cam = lamp_in_cam(*lamp.lamp, state.cam_from_world);
    const std::vector<double> here = rim_distances_px(in_cam, lamp, observations);
    distances.insert(distances.end(), here.begin(), here.end());
  }
  return median(std::move(distances));
}

}  // namespace occ::internal::refine
