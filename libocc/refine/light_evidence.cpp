// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/light_evidence.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/scene/internal/vignetting.hpp"

namespace occ::internal::refine {
namespace {

/// Flux of a blob over that of the brightest lamp from which on the blob is prominent.
constexpr double prominent = 3;

/// ln of the probability of `brighter` prominent blobs among `others`, over that of none. Their
/// rate has the density Beta(1, 6): a seventh on average.
double log_prominent(double brighter, double others) {
  constexpr double fainter = 6;
  return std::lgamma(1 + brighter) + std::lgamma(fainter + others - brighter) -
         std::lgamma(fainter + others);
}

double log_ratio_at(double log_gain, const std::vector<SeenLight>& lamps) {
  double sum = 0;
  for (const SeenLight& lamp : lamps) {
    double log = lamp.log_size;
    if (lamp.flux && !(lamp.flux->at_least && lamp.flux->log_ratio < log_gain))
      log -= 0.5 * square((lamp.flux->log_ratio - log_gain) / lamp.flux->sigma);
    sum += std::log((1 - lamp.open) * std::exp(log) + lamp.open);
  }
  return sum;
}

}  // namespace

std::optional<double> log_flux(const Blob& blob, const Scene& scene) {
  if (!(blob.flux_dn > 0 && blob.flux_sigma_dn > 0)) return std::nullopt;
  const double transmission = scene::Vignetting(scene).transmission(blob.centroid_px);
  if (!(transmission > 0)) return std::nullopt;
  return std::log(blob.flux_dn / transmission);
}

std::optional<FluxRatio> flux_ratio(const Lamp& lamp, const Blob& blob,
                                    const Rigid3& cam_from_world, const Scene& scene) {
  constexpr double light_sigma = 0.5;  // powers of lamps are seldom measured
  const auto measured = log_flux(blob, scene);
  if (!measured) return std::nullopt;
  const double light = lamp_electrons(lamp, cam_from_world, scene.camera, scene.sensor);
  if (!(light > 0)) return std::nullopt;
  FluxRatio ratio;
  ratio.log_light = std::log(light);
  ratio.log_ratio = *measured - ratio.log_light;
  ratio.sigma = std::sqrt(square(lamp.power_sigma) + square(blob.flux_sigma_dn / blob.flux_dn) +
                          square(light_sigma));
  ratio.at_least =
      blob.flux_is_lower_bound() || lamp.frequency_hz.has_value() || lamp.code.has_value();
  return ratio;
}

double log_light_ratio(const std::vector<SeenLight>& lamps,
                       const std::vector<double>& other_log_fluxes) {
  double brightest = -infinity;
  for (const SeenLight& lamp : lamps)
    if (lamp.flux) brightest = std::max(brightest, lamp.flux->log_light);
  if (std::isinf(brightest)) return log_ratio_at(0, lamps);
  double best = -infinity;
  for (const SeenLight& lamp : lamps) {
    if (!lamp.flux) continue;
    const double log_gain = lamp.flux->log_ratio;
    const auto first = std::upper_bound(other_log_fluxes.begin(), other_log_fluxes.end(),
                                        log_gain + brightest + std::log(prominent));
    best = std::max(best, log_ratio_at(log_gain, lamps) +
                              log_prominent(static_cast<double>(other_log_fluxes.end() - first),
                                            static_cast<double>(other_log_fluxes.size())));
  }
  return best;
}

}  // namespace occ::internal::refine
