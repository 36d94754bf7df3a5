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
#include "libocc/photometry/internal/poses.hpp"
#include "libocc/radiometry/lambertian.hpp"
#include "libocc/scene/internal/vignetting.hpp"

namespace occ {

using namespace internal::formation;
using namespace internal::photometry;
using namespace internal::scene;
namespace {

struct Found {
  FluxUse use = FluxUse::no_blob;
  const Blob* blob = nullptr;
};

std::optional<Eigen::Vector2d> place_of(const Lamp& lamp, const Rigid3& pose, const Scene& scene) {
  if (lamp_electrons(lamp, pose, scene.camera, scene.sensor) <= 0) return std::nullopt;
  return project_lamp_centre(lamp, pose, scene.camera);
}

/// The blob that a lamp's light is measured by, or why there is none.
Found usable(const Lamp& lamp, const Blob& blob) {
  if (blob.merged) return {FluxUse::merged, nullptr};
  if (blob.cut_by_border) return {FluxUse::cut, nullptr};
  if (blob.saturated || !(blob.flux_dn > 0)) return {FluxUse::saturated, nullptr};
  if (lamp.frequency_hz || !lamp.waveform.empty()) return {FluxUse::blinks, nullptr};
  return {FluxUse::used, &blob};
}

using Places = std::vector<std::optional<Eigen::Vector2d>>;  // of the lamps in one image

Found nearest(const std::vector<Lamp>& lamps, const Places& places, std::size_t lamp,
              const std::vector<Blob>& blobs, double gate_px) {
  if (!places[lamp]) return {FluxUse::out_of_view, nullptr};
  const auto near = [&](const Eigen::Vector2d& px) {
    return (px - *places[lamp]).norm() <= gate_px;
  };
  const Blob* found = nullptr;
  for (const Blob& blob : blobs) {
    if (!near(blob.centroid_px)) continue;
    if (found) return {FluxUse::not_alone, nullptr};
    found = &blob;
  }
  for (std::size_t other = 0; other < places.size(); ++other)
    if (other != lamp && places[other] && near(*places[other]))
      return {FluxUse::not_alone, nullptr};
  return found ? usable(lamps[lamp], *found) : Found{};
}

Found named(const std::vector<Lamp>& lamps, const Places& places, std::size_t lamp,
            const std::vector<Blob>& blobs, const std::vector<Match>& matches) {
  if (!places[lamp]) return {FluxUse::out_of_view, nullptr};
  for (const Match& match : matches)
    if (match.lamp == static_cast<int>(lamp)) return usable(lamps[lamp], blobs[match.blob]);
  return {};
}

std::string angles_of(const LampLight& light) {
  double least = 1, most = 0;
  int count = 0;
  for (const LampFlux& flux : light.fluxes) {
    if (flux.use != FluxUse::used) continue;
    least = std::min(least, flux.cos_emission);
    most = std::max(most, flux.cos_emission);
    ++count;
  }
  const auto degrees = [](double cosine) {
    return std::to_string(std::lround(std::acos(std::min(1.0, cosine)) * 180 / pi));
  };
  return std::to_string(count) + " fluxes at " + degrees(most) + " to " + degrees(least) +
         " degrees";
}

/// Seen over what the scene's power would give but for (m + 1) cos^m(phi).
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

void say_what_is_not_determined(const LightFit& fit, bool order_is, LampLight& light) {
  const bool seen = std::any_of(light.fluxes.begin(), light.fluxes.end(),
                                [](const LampFlux& f) { return f.use == FluxUse::used; });
  if (!seen) {
    light.status = Status::no_lamps;
    light.message = "seen whole and alone in no image";
  } else if (!order_is) {
    light.status = Status::degenerate;
    light.message = "its order is not determined by " + angles_of(light) +
                    "; the power holds for the scene's order";
  } else if (fit.variance_factor > 1) {
    light.message =
        "fluxes differ by more than their sigmas allow: poses, exposure or sensor are not as the "
        "scene says, or the lamp is not Lambertian";
  }
}

/// Lamps that share one scale of their powers.
struct Group {
  std::vector<std::size_t> lamps;
  std::vector<FluxEquation> equations;
};

/// Fits a group's light and tells it to its lamps.
LightFit fit_group(const Scene& scene, const Group& group, const LightOptions& options,
                   std::vector<LampLight>& lights) {
  Eigen::VectorXd orders(static_cast<Eigen::Index>(group.lamps.size()));
  for (std::size_t i = 0; i < group.lamps.size(); ++i)
    orders[static_cast<Eigen::Index>(i)] = scene.lamps[group.lamps[i]].order();
  const LightFit fit =
      fit_light(group.equations, orders, FitLimits{options.huber_sigma, options.max_order_sigma});
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
    say_what_is_not_determined(fit, fit.determined[i], light);
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

/// What is seen of the lamps, and nothing found out yet.
struct Seen {
  std::vector<LampLight> lights;
  std::vector<std::vector<FluxEquation>> equations;  // of each lamp
};

Seen seen_in(const Scene& scene, const Scene& rendered, const std::vector<std::vector<Blob>>& blobs,
             const std::vector<Rigid3>& cam_from_world,
             const std::vector<std::vector<Match>>* matches, const LightOptions& options) {
  const std::vector<Lamp>& lamps = rendered.lamps;
  Seen seen{std::vector<LampLight>(lamps.size()), {}};
  seen.equations.resize(lamps.size());
  for (std::size_t l = 0; l < lamps.size(); ++l) {
    seen.lights[l].id = lamps[l].id;
    seen.lights[l].power_w = scene.lamps[l].power_w;
    seen.lights[l].order = lamps[l].order();
  }
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    Places places;
    for (const Lamp& lamp : lamps) places.push_back(place_of(lamp, cam_from_world[i], rendered));
    for (std::size_t l = 0; l < lamps.size(); ++l) {
      LampFlux flux;
      flux.image = static_cast<int>(i);
      const Found blob = matches ? named(lamps, places, l, blobs[i], (*matches)[i])
                                 : nearest(lamps, places, l, blobs[i], options.gate_px);
      const bool whole =
          visible_part(lamps[l], rendered.boxes, cam_from_world[i].origin_in_source()).share == 1;
      flux.use = places[l] && !whole ? FluxUse::hidden : blob.use;
      if (flux.use == FluxUse::used)
        seen.equations[l].push_back(equation_of(lamps[l], *blob.blob, cam_from_world[i], rendered,
                                                options.model_sigma, flux));
      seen.lights[l].fluxes.push_back(flux);
    }
  }
  return seen;
}

void fit_each(const Seen& seen, const LightOptions& options, CalibratedLight& found) {
  for (std::size_t l = 0; l < seen.lights.size(); ++l) {
    const Group group{{l}, seen.equations[l]};
    if (group.equations.empty())
      say_what_is_not_determined({}, false, found.lamps[l]);
    else
      fit_group(found.scene, group, options, found.lamps);
  }
}

void fit_together(const Seen& seen, const LightOptions& options, CalibratedLight& found) {
  Group all;
  for (std::size_t l = 0; l < seen.lights.size(); ++l) {
    all.lamps.push_back(l);
    for (FluxEquation equation : seen.equations[l]) {
      equation.lamp = static_cast<int>(l);
      all.equations.push_back(equation);
    }
  }
  if (all.equations.empty()) {
    for (LampLight& light : found.lamps) say_what_is_not_determined({}, false, light);
    return;
  }
  const LightFit fit = fit_group(found.scene, all, options, found.lamps);
  found.factor = CommonFactor{std::exp(fit.scale), fit.covariance};
}

/// Into the scene goes what is determined; says whether that is anything.
bool take_over(CalibratedLight& found) {
  bool any = false;
  for (std::size_t l = 0; l < found.lamps.size(); ++l) {
    const LampLight& light = found.lamps[l];
    Lamp& known = found.scene.lamps[l];
    const bool ok = light.status == Status::ok;
    if (ok) known.half_power_rad = std::acos(std::exp2(-1 / light.order));
    if (!ok && !found.factor) continue;
    known.power_w = light.power_w;
    known.power_sigma = std::sqrt(light.covariance(0, 0));
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
  CalibratedLight& found = result.value;
  found.scene = scene;
  found.scene.validate();
  const Scene rendered = found.scene.as_rendered();
  const Seen seen = seen_in(found.scene, rendered, blobs, cam_from_world, matches, options);
  found.lamps = seen.lights;
  const bool together = options.powers == PowerFit::common_factor;
  together ? fit_together(seen, options, found) : fit_each(seen, options, found);
  if (!take_over(found)) {
    result.status = Status::degenerate;
    result.message = together ? "no lamp is seen whole and alone in any image"
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
