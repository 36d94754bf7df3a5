// SPDX-License-Identifier: Apache-2.0
#include "libocc/calibrate/light.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/formation/light.hpp"
#include "libocc/formation/rim.hpp"
#include "libocc/formation/vignetting.hpp"
#include "libocc/radiometry/lambertian.hpp"

namespace occ {
namespace {

constexpr int max_steps = 50;
constexpr double smallest_order = 0.05, largest_order = 200;

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
    if (match.lamp == static_cast<int>(lamp))
      return usable(lamps[lamp], blobs[static_cast<std::size_t>(match.blob)]);
  return {};
}

/// ln F - ln G = ln P + ln(m + 1) + m ln cos(phi), of one image.
struct Equation {
  double log_cos = 0, seen = 0, sigma = 1;
};

double residual(const Equation& e, const Eigen::Vector2d& x) {
  return e.seen - x[0] - std::log(x[1] + 1) - x[1] * e.log_cos;
}

struct Normal {
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double chi2 = 0;
};

/// Huber's weights where the parameters are now.
Normal normal_at(const std::vector<Equation>& equations, const Eigen::Vector2d& x, double huber) {
  Normal sum;
  for (const Equation& e : equations) {
    const double left = residual(e, x), off = std::abs(left) / e.sigma;
    const double weight = (off <= huber ? 1 : huber / off) / (e.sigma * e.sigma);
    const Eigen::Vector2d row(1, 1 / (x[1] + 1) + e.log_cos);
    sum.matrix += weight * row * row.transpose();
    sum.right += weight * left * row;
    sum.chi2 += weight * left * left;
  }
  return sum;
}

/// x = (ln P, m) from its start; the order is held unless `with_order`. False when steps come to no
/// end.
bool fit(const std::vector<Equation>& equations, bool with_order, double huber,
         Eigen::Vector2d& x) {
  for (int step = 0; step < max_steps; ++step) {
    const Normal normal = normal_at(equations, x, huber);
    Eigen::Vector2d d(normal.right[0] / normal.matrix(0, 0), 0);
    if (with_order) {
      if (!(normal.matrix.determinant() > 0)) return false;
      d = normal.matrix.inverse() * normal.right;
    }
    if (!d.allFinite()) return false;
    const double order = std::clamp(x[1] + d[1], smallest_order, largest_order);
    const bool still = std::abs(d[0]) < 1e-9 && std::abs(order - x[1]) < 1e-9;
    x = {x[0] + d[0], order};
    if (still) return order > smallest_order && order < largest_order;
  }
  return false;
}

void state(const std::vector<Equation>& equations, bool with_order, const LightOptions& options,
           const Eigen::Vector2d& x, LampLight& light) {
  const Normal normal = normal_at(equations, x, options.huber_sigma);
  light.power_w = std::exp(x[0]);
  light.order = x[1];
  light.chi2 = normal.chi2;
  light.dof = static_cast<int>(equations.size()) - (with_order ? 2 : 1);
  light.variance_factor = variance_factor(light.chi2, light.dof);
  light.covariance = unknown_covariance<2>();
  if (with_order) {
    light.covariance = light.variance_factor * normal.matrix.inverse();
  } else {
    light.covariance(0, 0) = light.variance_factor / normal.matrix(0, 0);
  }
  auto next = equations.begin();
  for (LampFlux& flux : light.fluxes)
    if (flux.use == FluxUse::used) flux.residual = residual(*next++, x);
}

std::string angles_of(const std::vector<Equation>& equations) {
  const auto by_cos = [](const Equation& a, const Equation& b) { return a.log_cos > b.log_cos; };
  const auto [least, most] = std::minmax_element(equations.begin(), equations.end(), by_cos);
  const auto degrees = [](const Equation& e) {
    return std::to_string(std::lround(std::acos(std::min(1.0, std::exp(e.log_cos))) * 180 / M_PI));
  };
  return std::to_string(equations.size()) + " fluxes at " + degrees(*least) + " to " +
         degrees(*most) + " degrees";
}

/// Seen over what a lamp of 1 W and order zero would give but for its (1 / 2 pi).
Equation equation_of(Lamp lamp, const Blob& blob, const Rigid3& pose, const Scene& scene,
                     double model_sigma, LampFlux& flux) {
  const Eigen::Vector3d centre = pose * lamp.centre_m;
  flux.cos_emission = -centre.dot(pose.rotation * lamp.normal) / centre.norm();
  flux.flux_dn = blob.flux_dn;
  flux.sigma = std::hypot(blob.flux_sigma_dn / blob.flux_dn, model_sigma);
  lamp.power_w = 1;
  const double electrons = lamp_electrons(lamp, pose, scene.camera, scene.sensor) *
                           Vignetting(scene).transmission(blob.centroid_px);
  const double log_cos = std::log(flux.cos_emission), order = lamp.order();
  const double log_unit =
      std::log(scene.sensor.gain_dn_per_e * electrons) - std::log(order + 1) - order * log_cos;
  return {log_cos, std::log(blob.flux_dn) - log_unit, flux.sigma};
}

void fit_light(const Lamp& lamp, const std::vector<Equation>& equations,
               const LightOptions& options, LampLight& light) {
  const Eigen::Vector2d start(std::log(lamp.power_w), lamp.order());
  Eigen::Vector2d x = start;
  const auto failed = [&](Status status, const std::string& message) {
    light.status = status;
    light.message = message;
  };
  light.power_w = lamp.power_w;
  light.order = lamp.order();
  if (equations.empty()) return failed(Status::no_lamps, "seen whole and alone in no image");
  if (equations.size() >= 3 && fit(equations, true, options.huber_sigma, x)) {
    state(equations, true, options, x, light);
    if (std::sqrt(light.covariance(1, 1)) <= options.max_order_sigma) {
      if (light.variance_factor > 1)
        light.message =
            "fluxes differ by more than their sigmas allow: poses, exposure or sensor "
            "are not as the scene says, or the lamp is not Lambertian";
      return;
    }
  }
  x = start;
  fit(equations, false, options.huber_sigma, x);
  state(equations, false, options, x, light);
  failed(Status::degenerate, "its order is not determined by " + angles_of(equations) +
                                 "; the power holds for the scene's order");
}

void validate_input(const std::vector<std::vector<Blob>>& blobs,
                    const std::vector<Rigid3>& cam_from_world) {
  require(blobs.size() == cam_from_world.size(), "cam_from_world", cam_from_world.size(),
          "one pose for each of " + std::to_string(blobs.size()) + " images");
  for (std::size_t i = 0; i < cam_from_world.size(); ++i)
    Rigid3::from_matrix(cam_from_world[i].matrix(),
                        ("cam_from_world[" + std::to_string(i) + "]").c_str());
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

Result<CalibratedLight> calibrated(const Scene& scene, const std::vector<std::vector<Blob>>& blobs,
                                   const std::vector<Rigid3>& cam_from_world,
                                   const std::vector<std::vector<Match>>* matches,
                                   const LightOptions& options) {
  options.validate();
  validate_input(blobs, cam_from_world);
  Result<CalibratedLight> result;
  CalibratedLight& found = result.value;
  found.scene = scene;
  found.scene.validate();
  const std::vector<Lamp> lamps = found.scene.lamps;
  std::vector<Places> places(blobs.size());
  for (std::size_t i = 0; i < blobs.size(); ++i)
    for (const Lamp& lamp : lamps) places[i].push_back(place_of(lamp, cam_from_world[i], scene));

  int calibrated = 0;
  for (std::size_t l = 0; l < lamps.size(); ++l) {
    LampLight light;
    light.id = lamps[l].id;
    std::vector<Equation> equations;
    for (std::size_t i = 0; i < blobs.size(); ++i) {
      LampFlux flux;
      flux.image = static_cast<int>(i);
      const Found blob = matches ? named(lamps, places[i], l, blobs[i], (*matches)[i])
                                 : nearest(lamps, places[i], l, blobs[i], options.gate_px);
      flux.use = blob.use;
      if (flux.use == FluxUse::used)
        equations.push_back(equation_of(lamps[l], *blob.blob, cam_from_world[i], found.scene,
                                        options.model_sigma, flux));
      light.fluxes.push_back(flux);
    }
    fit_light(lamps[l], equations, options, light);
    if (light.status == Status::ok) {
      Lamp& known = found.scene.lamps[l];
      known.power_w = light.power_w;
      known.power_sigma = std::sqrt(light.covariance(0, 0));
      known.half_power_rad = std::acos(std::exp2(-1 / light.order));
      ++calibrated;
    }
    found.lamps.push_back(std::move(light));
  }
  if (calibrated == 0) {
    result.status = Status::degenerate;
    result.message = "no lamp's power and order are determined";
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
