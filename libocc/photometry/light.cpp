// SPDX-License-Identifier: Apache-2.0
#include "libocc/photometry/light.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/formation/internal/shadow.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/photometry/internal/light_fit.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/scene/internal/vignetting.hpp"

namespace occ {

using namespace internal::formation;
using namespace internal::photometry;
using namespace internal::scene;
namespace {

/// The blob of a lamp, or the reason why there is none.
struct BlobUse {
  FluxUse use = FluxUse::no_blob;
  const Blob* blob = nullptr;
};

/// Predicted image of a lamp that faces the camera.
std::optional<Eigen::Vector2d> visible_centre(const Lamp& lamp, const Rigid3& pose,
                                              const Scene& scene) {
  if (lamp_electrons(lamp, pose, scene.camera, scene.sensor) <= 0) return std::nullopt;
  return project_lamp_centre(lamp, pose, scene.camera);
}

/// Accepts a lamp's blob, or gives the reason for its exclusion.
BlobUse classify(const Lamp& lamp, const Blob& blob) {
  if (blob.merged) return {FluxUse::merged, nullptr};
  if (blob.cut_by_border) return {FluxUse::cut, nullptr};
  if (blob.hidden_in_part) return {FluxUse::hidden, nullptr};
  if (blob.saturated || !(blob.flux_dn > 0)) return {FluxUse::saturated, nullptr};
  if (lamp.frequency_hz || !lamp.waveform.empty()) return {FluxUse::blinks, nullptr};
  return {FluxUse::used, &blob};
}

using Centres = std::vector<std::optional<Eigen::Vector2d>>;  // of the lamps in one image

BlobUse nearest_blob(const std::vector<Lamp>& lamps, const Centres& centres, std::size_t lamp,
                     const std::vector<Blob>& blobs, double gate_px) {
  if (!centres[lamp]) return {FluxUse::out_of_view, nullptr};
  const auto near = [&](const Eigen::Vector2d& px) {
    return (px - *centres[lamp]).norm() <= gate_px;
  };
  const Blob* result = nullptr;
  for (const Blob& blob : blobs) {
    if (!near(blob.centroid_px)) continue;
    if (result) return {FluxUse::not_alone, nullptr};
    result = &blob;
  }
  for (std::size_t other = 0; other < centres.size(); ++other)
    if (other != lamp && centres[other] && near(*centres[other]))
      return {FluxUse::not_alone, nullptr};
  return result ? classify(lamps[lamp], *result) : BlobUse{};
}

BlobUse matched_blob(const std::vector<Lamp>& lamps, const Centres& centres, std::size_t lamp,
                     const std::vector<Blob>& blobs, const std::vector<Match>& matches) {
  if (!centres[lamp]) return {FluxUse::out_of_view, nullptr};
  for (const Match& match : matches)
    if (match.lamp == static_cast<int>(lamp)) return classify(lamps[lamp], blobs[match.blob]);
  return {};
}

std::string describe_angles(const LampLight& light) {
  double min_cos = 1, max_cos = 0;
  int count = 0;
  for (const LampFlux& flux : light.fluxes) {
    if (flux.use != FluxUse::used) continue;
    min_cos = std::min(min_cos, flux.cos_emission);
    max_cos = std::max(max_cos, flux.cos_emission);
    ++count;
  }
  const auto degrees = [](double cosine) {
    return std::to_string(std::lround(std::acos(std::min(1.0, cosine)) * 180 / pi));
  };
  return std::to_string(count) + " fluxes at " + degrees(max_cos) + " to " + degrees(min_cos) +
         " degrees";
}

/// Equation of one flux: observed flux over the flux of the scene's power without the factor
/// (m + 1) cos^m(phi). For a lamp with photometry this factor stands for its emission: it cancels,
/// since the order is held.
FluxEquation equation_of(const Lamp& lamp, const Blob& blob, const Rigid3& pose, const Scene& scene,
                         double model_sigma, LampFlux& flux) {
  const Eigen::Vector3d centre = pose * lamp.centre_m;
  flux.cos_emission = -centre.dot(pose.rotation * lamp.normal) / centre.norm();
  flux.flux_dn = blob.flux_dn;
  flux.sigma = std::hypot(blob.flux_sigma_dn / blob.flux_dn, model_sigma);
  const double electrons = lamp_electrons(lamp, pose, scene.camera, scene.sensor) *
                           Vignetting(scene).transmission(blob.centroid_px);
  const double log_cos = std::log(flux.cos_emission), order = lamp.order();
  const double log_unit =
      std::log(scene.sensor.gain_dn_per_e * electrons) - std::log(order + 1) - order * log_cos;
  return {0, log_cos, std::log(blob.flux_dn) - log_unit, flux.sigma};
}

void set_status(const LightFit& fit, bool order_determined, LampLight& light) {
  const bool observed = std::any_of(light.fluxes.begin(), light.fluxes.end(),
                                    [](const LampFlux& f) { return f.use == FluxUse::used; });
  if (!observed) {
    light.status = Status::no_lamps;
    light.message = "no image shows it unobstructed and isolated";
  } else if (!order_determined) {
    light.status = Status::degenerate;
    light.message = "its order is not determined by " + describe_angles(light) +
                    "; the power holds for the scene's order";
  } else if (fit.variance_factor > 1) {
    light.message =
        "fluxes differ by more than their sigmas allow: poses, exposure or sensor differ from the "
        "scene, or the lamp is not Lambertian";
  }
}

/// Lamps that share one scale of their powers.
struct Group {
  std::vector<std::size_t> lamps;
  std::vector<FluxEquation> equations;
};

/// Fits the light of a group and stores it in `lights`.
LightFit fit_group(const Scene& scene, const Group& group, const LightOptions& options,
                   std::vector<LampLight>& lights) {
  Eigen::VectorXd orders(static_cast<Eigen::Index>(group.lamps.size()));
  std::vector<bool> held_orders;
  for (std::size_t i = 0; i < group.lamps.size(); ++i) {
    const Lamp& lamp = scene.lamps[group.lamps[i]];
    orders[static_cast<Eigen::Index>(i)] = lamp.order();
    held_orders.push_back(lamp.photometry != nullptr);
  }
  const LightFit fit = fit_light(group.equations, orders, held_orders,
                                 FitLimits{options.huber_sigma, options.max_order_sigma});
  auto equation = group.equations.begin();
  for (std::size_t i = 0; i < group.lamps.size(); ++i) {
    const auto order = static_cast<Eigen::Index>(i);
    LampLight& light = lights[group.lamps[i]];
    light.power_w = scene.lamps[group.lamps[i]].power_w * std::exp(fit.scale);
    light.order = fit.orders[order];
    light.covariance(0, 0) = fit.covariance(0, 0);
    light.covariance(1, 1) = fit.covariance(order + 1, order + 1);
    light.covariance(0, 1) = light.covariance(1, 0) = fit.covariance(0, order + 1);
    light.chi2 = fit.chi2;
    light.dof = fit.dof;
    light.variance_factor = fit.variance_factor;
    for (LampFlux& flux : light.fluxes)
      if (flux.use == FluxUse::used) flux.residual = fit.residual(*equation++);
    set_status(fit, fit.determined[i] || held_orders[i], light);
  }
  return fit;
}

void validate_matches(const std::vector<std::vector<Match>>& matches,
                      const std::vector<std::vector<Blob>>& blobs, std::size_t lamps) {
  require(matches.size() == blobs.size(), "matches", matches.size(),
          "a list for each of " + std::to_string(blobs.size()) + " images");
  for (std::size_t i = 0; i < matches.size(); ++i)
    for (const Match& match : matches[i]) {
      const std::string name = "matches[" + std::to_string(i) + "].";
      require(match.lamp >= 0 && match.lamp < static_cast<int>(lamps), name + "lamp", match.lamp,
              "an index of the scene's lamps");
      require(match.blob >= 0 && match.blob < static_cast<int>(blobs[i].size()), name + "blob",
              match.blob, "an index of the image's blobs");
    }
}

/// Used fluxes of all lamps; the lights hold start values.
struct FluxObservations {
  std::vector<LampLight> lights;
  std::vector<std::vector<FluxEquation>> equations;  // one list per lamp
};

FluxObservations observe(const Scene& scene, const Scene& rendered,
                         const std::vector<std::vector<Blob>>& blobs,
                         const std::vector<Rigid3>& cam_from_world,
                         const std::vector<std::vector<Match>>* matches,
                         const LightOptions& options) {
  const std::vector<Lamp>& lamps = rendered.lamps;
  FluxObservations observations{std::vector<LampLight>(lamps.size()), {}};
  observations.equations.resize(lamps.size());
  for (std::size_t l = 0; l < lamps.size(); ++l) {
    observations.lights[l].id = lamps[l].id;
    observations.lights[l].power_w = scene.lamps[l].power_w;
    observations.lights[l].order = lamps[l].order();
  }
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    Centres centres;
    for (const Lamp& lamp : lamps)
      centres.push_back(visible_centre(lamp, cam_from_world[i], rendered));
    for (std::size_t l = 0; l < lamps.size(); ++l) {
      LampFlux flux;
      flux.image = static_cast<int>(i);
      const BlobUse blob = matches ? matched_blob(lamps, centres, l, blobs[i], (*matches)[i])
                                   : nearest_blob(lamps, centres, l, blobs[i], options.gate_px);
      const bool unobstructed =
          visible_part(lamps[l], rendered.boxes, cam_from_world[i].origin_in_source()).share == 1;
      flux.use = centres[l] && !unobstructed ? FluxUse::hidden : blob.use;
      if (flux.use == FluxUse::used)
        observations.equations[l].push_back(equation_of(lamps[l], *blob.blob, cam_from_world[i],
                                                        rendered, options.model_sigma, flux));
      observations.lights[l].fluxes.push_back(flux);
    }
  }
  return observations;
}

void fit_each(const FluxObservations& observations, const LightOptions& options,
              CalibratedLight& result) {
  for (std::size_t l = 0; l < observations.lights.size(); ++l) {
    const Group group{{l}, observations.equations[l]};
    if (group.equations.empty())
      set_status({}, false, result.lamps[l]);
    else
      fit_group(result.scene, group, options, result.lamps);
  }
}

void fit_together(const FluxObservations& observations, const LightOptions& options,
                  CalibratedLight& result) {
  Group all;
  for (std::size_t l = 0; l < observations.lights.size(); ++l) {
    all.lamps.push_back(l);
    for (FluxEquation equation : observations.equations[l]) {
      equation.lamp = static_cast<int>(l);
      all.equations.push_back(equation);
    }
  }
  if (all.equations.empty()) {
    for (LampLight& light : result.lamps) set_status({}, false, light);
    return;
  }
  const LightFit fit = fit_group(result.scene, all, options, result.lamps);
  result.factor = CommonFactor{std::exp(fit.scale), fit.covariance};
}

/// Writes the determined values into the scene; false when there are none.
bool update_scene(CalibratedLight& result) {
  bool any = false;
  for (std::size_t l = 0; l < result.lamps.size(); ++l) {
    const LampLight& light = result.lamps[l];
    Lamp& lamp = result.scene.lamps[l];
    const bool ok = light.status == Status::ok;
    if (ok && !lamp.photometry) lamp.half_power_rad = std::acos(std::exp2(-1 / light.order));
    if (!ok && !result.factor) continue;
    lamp.power_w = light.power_w;
    lamp.power_sigma = std::sqrt(light.covariance(0, 0));
    any = true;
  }
  return any;
}

Result<CalibratedLight> calibrated(const Scene& scene, const std::vector<std::vector<Blob>>& blobs,
                                   const std::vector<Rigid3>& cam_from_world,
                                   const std::vector<std::vector<Match>>* matches,
                                   const LightOptions& options) {
  options.validate();
  validate_poses(blobs.size(), cam_from_world);
  Result<CalibratedLight> result;
  CalibratedLight& calibration = result.value;
  calibration.scene = scene;
  calibration.scene.validate();
  const Scene rendered = calibration.scene.as_rendered();
  const FluxObservations observations =
      observe(calibration.scene, rendered, blobs, cam_from_world, matches, options);
  calibration.lamps = observations.lights;
  const bool together = options.powers == PowerFit::common_factor;
  together ? fit_together(observations, options, calibration)
           : fit_each(observations, options, calibration);
  if (!update_scene(calibration)) {
    result.status = Status::degenerate;
    result.message = together ? "no image shows a lamp unobstructed and isolated"
                              : "no lamp's power and order are determined";
  }
  return result;
}

}  // namespace

void LightOptions::validate() const {
  require(gate_px > 0 && std::isfinite(gate_px), "gate_px", gate_px, "positive");
  require(model_sigma >= 0 && std::isfinite(model_sigma), "model_sigma", model_sigma,
          "zero or positive");
  require(huber_sigma > 0, "huber_sigma", huber_sigma, "positive");
  require(max_order_sigma > 0, "max_order_sigma", max_order_sigma, "positive");
}

const char* to_string(FluxUse use) {
  switch (use) {
    case FluxUse::used:
      return "used";
    case FluxUse::out_of_view:
      return "out_of_view";
    case FluxUse::hidden:
      return "hidden";
    case FluxUse::no_blob:
      return "no_blob";
    case FluxUse::not_alone:
      return "not_alone";
    case FluxUse::saturated:
      return "saturated";
    case FluxUse::cut:
      return "cut";
    case FluxUse::merged:
      return "merged";
    case FluxUse::blinks:
      return "blinks";
  }
  return "?";
}

Result<CalibratedLight> calibrate_light(const Scene& scene,
                                        const std::vector<std::vector<Blob>>& blobs,
                                        const std::vector<Rigid3>& cam_from_world,
                                        const LightOptions& options) {
  return calibrated(scene, blobs, cam_from_world, nullptr, options);
}

Result<CalibratedLight> calibrate_light(const Scene& scene,
                                        const std::vector<std::vector<Blob>>& blobs,
                                        const std::vector<Rigid3>& cam_from_world,
                                        const std::vector<std::vector<Match>>& matches,
                                        const LightOptions& options) {
  validate_matches(matches, blobs, scene.lamps.size());
  return calibrated(scene, blobs, cam_from_world, &matches, options);
}

}  // namespace occ
