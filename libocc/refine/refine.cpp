// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/refine.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "libocc/core/internal/fields.hpp"
#include "libocc/core/internal/robust_loss.hpp"
#include "libocc/core/require.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/refine/internal/estimated_map.hpp"
#include "libocc/refine/internal/flat_minimum.hpp"
#include "libocc/refine/internal/lamp_contradictions.hpp"
#include "libocc/refine/internal/light_errors.hpp"
#include "libocc/refine/internal/minimise.hpp"
#include "libocc/refine/internal/outliers.hpp"
#include "libocc/refine/internal/pose_covariance.hpp"
#include "libocc/refine/internal/predicted_centroid.hpp"
#include "libocc/refine/internal/prior_rows.hpp"
#include "libocc/refine/internal/refine_fields.hpp"
#include "libocc/refine/internal/residuals.hpp"
#include "libocc/refine/internal/shared_profile.hpp"

namespace occ {

using namespace internal::refine;
namespace {

/// Tolerance of the fit of centroids that precedes the fit of rims.
constexpr double rough_tolerance_px = 0.01;

/// A lamp whose pixels exceed their noise by more than this factor does not match the scene.
constexpr double max_misfit = 4;

/// Limit of |ln| of the PSF's width over the rendered one; a linear correction is inaccurate
/// beyond.
constexpr double max_spread = 0.15;
constexpr double min_psf_px = 0.2, max_psf_px = 20;
constexpr int max_revisions = 5;

/// Factor of the tolerance for the direct rung, each step of which leaves less than 1 % of the
/// error.
constexpr double direct_tolerance = 100;

/// Minimum for the centroids alone. Its basin of convergence is far wider than that of the rims,
/// and contradicting lamps are found at little cost.
Minimum minimise_by_centroids(const State& start, Observations& observations, const Scene& scene,
                              const RefineOptions& options, double tolerance_px) {
  const Rung cheap = std::min(options.rung, Rung::centres);
  RefineProblem problem(observations, scene, options, cheap);
  Minimum minimum = minimise(problem, start, options.max_iterations, tolerance_px);
  while (minimum.converged && std::isfinite(options.huber_sigma)) {
    const std::optional<std::size_t> worst = contradicting_lamp(
        observations, problem, minimum, observations.degrees_of_freedom(options, cheap));
    if (!worst) break;
    observations.lamps[*worst].contradicts = true;
    minimum = minimise(problem, minimum.state, options.max_iterations, tolerance_px);
  }
  return minimum;
}

/// Chi-square of the lamps that were left out, so that a pose without contradictions ranks higher.
double contradiction_chi2(const Observations& observations, const Scene& scene, const State& state,
                          Rung rung, double huber_sigma) {
  double sum = 0;
  for (const LampObservation& lamp : observations.lamps) {
    if (!lamp.contradicts || !lamp.has_centroid) continue;
    const std::optional<Eigen::Vector2d> centre =
        predicted_centroid_px(*lamp.lamp, *lamp.blob, state.cam_from_world, scene, rung);
    if (!centre) continue;
    const Eigen::Vector2d residual = scene.camera.difference_px(lamp.blob->centroid_px, *centre);
    Eigen::Matrix2d information = lamp.centroid_information;
    if (lamp.errors || observations.shared_errors.count() > 0)
      information =
          (information.inverse() + image_covariance_px2(*lamp.lamp, state.cam_from_world, scene))
              .inverse();
    const double chi2 = residual.dot(information * residual);
    const double weight = internal::core::huber_weight(chi2, huber_sigma);
    sum += weight * (2 - weight) * chi2;
  }
  return sum;
}

constexpr int plenty = 8;  // equations of centroids that determine a pose with redundancy

/// Minimum for the rungs below direct, one after the other.
Minimum minimise_by_rims(const State& start, Observations& observations, const Scene& scene,
                         const RefineOptions& options, double tolerance_px) {
  const bool has_rims = !observations.rim.empty();
  State near = start;
  if (observations.equations(options, Rung::centres) >= 6 || !has_rims) {
    const Minimum by_centroids = minimise_by_centroids(
        start, observations, scene, options, has_rims ? rough_tolerance_px : tolerance_px);
    if (!has_rims) return by_centroids;
    if (by_centroids.converged) near = by_centroids.state;
    if (by_centroids.converged && observations.equations(options, Rung::centres) >= plenty)
      leave_out_false_rims(near, observations);
  }
  if (observations.rims_grow) {
    near.growth_px = typical_growth_px(near, observations);
    observations.move_rims(near.growth_px, scene.camera);
  }
  const auto report = [&](const RefineProblem& problem, const Minimum& minimum) {
    for (std::size_t i = 0; i < observations.lamps.size(); ++i)
      if (observations.lamps[i].errors) observations.lamps[i].unit_error = problem.lamp_error(i);
    problem.report_own_chi2(minimum.state, observations.lamps);
    return minimum;
  };
  std::optional<RefineProblem> problem;
  const auto minimise_from = [&](const State& state) {
    problem.emplace(observations, scene, options, Rung::rims);
    return minimise(*problem, state, options.max_iterations, tolerance_px);
  };
  Minimum minimum = minimise_from(near);
  if (observations.rims_grow && minimum.converged &&
      observations.move_rims(minimum.state.growth_px, scene.camera))
    minimum = minimise_from(minimum.state);
  const bool errors =
      std::any_of(observations.lamps.begin(), observations.lamps.end(),
                  [](const LampObservation& lamp) { return lamp.errors.has_value(); });
  if (!minimum.converged && errors) {
    // Few centroids follow the errors of the map, and may lead away from the pose.
    RefineProblem again(observations, scene, options, Rung::rims);
    const Minimum other = minimise(again, start, options.max_iterations, tolerance_px);
    if (other.converged) return report(again, other);
  }
  return report(*problem, minimum);
}

/// Start value for the direct rung, from centroids alone if their redundancy is sufficient.
Minimum minimise_roughly(const State& start, Observations& observations, const Scene& scene,
                         const RefineOptions& options) {
  if (!observations.rims_grow && observations.equations(options, Rung::centres) >= plenty) {
    const Minimum by_centroids =
        minimise_by_centroids(start, observations, scene, options, rough_tolerance_px);
    if (by_centroids.converged) return by_centroids;
  }
  return minimise_by_rims(start, observations, scene, options, rough_tolerance_px);
}

/// Sets the PSF's width to that of the pixels if it differs too much from the rendered one;
/// otherwise removes the pixels of lamps that do not fit their model. Returns true if it changed
/// anything.
bool revise(const RefineProblem& problem, Observations& observations) {
  double log_spread = 0;
  int count = 0;
  for (std::size_t i = 0; i < observations.lamps.size(); ++i) {
    if (!problem.pixels(i)) continue;
    log_spread += problem.pixels(i)->log_spread();
    ++count;
  }
  log_spread /= std::max(1, count);
  if (std::abs(log_spread) > max_spread) {
    const double revised = observations.psf_sigma_px * std::exp(log_spread);
    observations.psf_sigma_px = std::clamp(revised, min_psf_px, max_psf_px);
    return true;
  }
  bool dropped = false;
  for (std::size_t i = 0; i < observations.lamps.size(); ++i) {
    if (!problem.pixels(i) || problem.pixels(i)->misfit() <= max_misfit) continue;
    observations.lamps[i].window = {};
    dropped = true;
  }
  return dropped;
}

/// Minimum for the pixels; empty if the iteration does not converge.
std::optional<Minimum> minimise_by_pixels(const State& start, Observations& observations,
                                          const Scene& scene, const RefineOptions& options) {
  for (int pass = 0; pass < max_revisions && observations.has_pixels(); ++pass) {
    RefineProblem problem(observations, scene, options, Rung::direct);
    const double tolerance_px = direct_tolerance * options.tolerance_px;
    Minimum minimum = polish(problem, start, options.max_iterations, tolerance_px);
    if (minimum.converged && problem.free_emission(minimum.normal)) {
      minimum = polish(problem, minimum.state, options.max_iterations, tolerance_px);
    }
    if (!minimum.converged) return std::nullopt;
    if (revise(problem, observations)) continue;
    for (std::size_t i = 0; i < observations.lamps.size(); ++i) {
      if (problem.pixels(i)) observations.lamps[i].misfit = problem.pixels(i)->misfit();
    }
    return minimum;
  }
  return std::nullopt;
}

/// Minimum for the rungs below direct if there are shared errors. They can move the image by many
/// pixels, so the scene is linearised anew at their estimate until that is stable. The estimates
/// by centroids converge from farther away than those by rims.
Minimum minimise_with_shared_errors(const State& start, const std::vector<Match>& matches,
                                    const std::vector<Blob>& blobs, const RefineOptions& options,
                                    Observations& observations, Scene& scene) {
  constexpr int max_passes = 20;
  constexpr double rough_sigmas = 0.01;
  const Scene stated = scene;
  /// Returns the step in sigmas; infinite if there is no camera with the estimates.
  const auto linearise_at = [&](const Minimum& minimum) {
    const double step = (minimum.shared_errors - observations.shared_shift).norm();
    if (!linearise_shared(minimum.shared_errors, stated, matches, blobs, options, observations,
                          scene))
      return infinity;
    observations.move_rims(minimum.state.growth_px, scene.camera);
    return step;
  };
  Minimum minimum{start};
  if (observations.equations(options, Rung::centres) >= 6 && !observations.rim.empty()) {
    for (int pass = 0; pass < max_passes; ++pass) {
      Minimum rough =
          minimise_by_centroids(minimum.state, observations, scene, options, rough_tolerance_px);
      if (!rough.defined) break;
      minimum = std::move(rough);
      const double step = linearise_at(minimum);
      if (step < rough_sigmas || std::isinf(step)) break;
    }
  }
  if (observations.rim.empty() || !minimum.defined)
    minimum = minimise_by_rims(minimum.state, observations, scene, options, rough_tolerance_px);
  minimum.converged = false;
  for (int pass = 0; pass < options.max_iterations && minimum.defined; ++pass) {
    const double step = linearise_at(minimum);
    if (std::isinf(step)) {
      minimum.converged = false;
      break;
    }
    const bool is_last = minimum.converged && step < stable_sigmas;
    const Rung rung = observations.rim.empty() ? std::min(options.rung, Rung::centres) : Rung::rims;
    RefineProblem problem(observations, scene, options, rung);
    Minimum next = step_with_shared_errors(problem, minimum.state, options.tolerance_px);
    if (!next.defined) {  // diverged: a lamp left the camera's domain
      minimum.converged = false;
      break;
    }
    minimum = std::move(next);
    minimum.iterations = pass + 1;
    for (std::size_t i = 0; i < observations.lamps.size(); ++i)
      if (observations.lamps[i].has_rim()) observations.lamps[i].unit_error = problem.lamp_error(i);
    problem.report_own_chi2(minimum.state, observations.lamps);
    minimum.converged = is_last || (minimum.converged && step < stable_sigmas);
    if (is_last) break;
  }
  return minimum;
}

Minimum find_minimum(const State& start, Observations& observations, const Scene& scene,
                     const RefineOptions& options) {
  if (observations.has_pixels()) {
    const Minimum rough = minimise_roughly(start, observations, scene, options);
    if (rough.converged) {
      if (const auto direct = minimise_by_pixels(rough.state, observations, scene, options)) {
        return *direct;
      }
    }
    for (LampObservation& lamp : observations.lamps) lamp.window = {};
  }
  return minimise_by_rims(start, observations, scene, options, options.tolerance_px);
}

std::string too_few_message(std::size_t lamps, int equations) {
  std::ostringstream text;
  text << lamps << " lamps give " << equations << " equations, a pose has 6 unknowns";
  return text.str();
}

/// At the minimum the gradient of the lamps is opposite to that of the prior.
void report_lamps(const Minimum& minimum, const RefineOptions& options, Refined& refined) {
  const double factor = refined.variance_factor;
  if (!options.prior || options.prior->empty()) {
    refined.lamp_information = pose_information(minimum.normal, minimum.pivot) / factor;
    return;
  }
  PoseNormalEquations prior;
  add_prior(*options.prior, minimum.state.cam_from_world, minimum.pivot, prior);
  refined.lamp_information = lamp_information(minimum.normal, prior, minimum.pivot) / factor;
  const PriorRows rows = options.prior->rows(minimum.state.cam_from_world);
  refined.lamp_gradient = -rows.jacobian.transpose() * rows.residuals / factor;
}

/// `matches`: of the lamps of the minimum's parts.
void report_separation(const Minimum& minimum, const std::vector<Match>& matches,
                       const std::vector<LampObservation>& lamps, Refined& refined) {
  std::vector<int> indices;
  for (const Match& match : matches) indices.push_back(match.lamp);
  const Rigid3& pose = minimum.state.cam_from_world;
  refined.separation =
      separation_model(minimum.parts, indices, pose, minimum.pivot, minimum.shared_errors);
  refined.separation.variance_factor = refined.variance_factor;
  refined.separation.position_covariance_m2 = position_covariance(pose, refined.covariance);
  refined.separation.excluded = static_cast<int>(std::count_if(
      lamps.begin(), lamps.end(), [](const LampObservation& lamp) { return lamp.contradicts; }));
}

double factor_of(const LampContradiction& lamps) {
  return lamps.factor > 1 ? lamps.factor * few_lamps_factor(lamps.dof) : 1;
}

void conclude(const Minimum& minimum, const RefineOptions& options,
              const std::vector<Match>& matches, const std::vector<LampObservation>& lamps,
              Result<Refined>& result) {
  if (!minimum.defined) {
    result.status = Status::not_converged;
    result.message =
        "from the start pose a matched lamp is behind the camera or shows its dark side";
    return;
  }
  const PoseCovariance pose = pose_covariance(minimum.normal, minimum.pivot);
  if (pose.rank < 6) {
    result.status = Status::degenerate;
    result.message = "the lamps do not determine the pose: they are collinear or coincide";
    return;
  }
  result.value.variance_factor = std::max(variance_factor(minimum.normal.robust_chi2, result->dof),
                                          factor_of(contradiction_of(lamps)));
  Matrix6& covariance = result.value.covariance;
  covariance = result->variance_factor * pose.covariance + minimum.bend;
  covariance.bottomRightCorner<3, 3>() +=
      arc_moment(covariance.topLeftCorner<3, 3>(), minimum.pivot);
  report_lamps(minimum, options, result.value);
  report_separation(minimum, matches, lamps, result.value);
  if (minimum.converged) return;
  result.status = Status::not_converged;
  result.message = "not converged after " + std::to_string(options.max_iterations) + " iterations";
}

}  // namespace

void RefineOptions::validate() const {
  if (prior) prior->validate();
  internal::core::check_fields(*this, refine_fields, "");
}

namespace {

/// Tolerance of the steps, at least 0.5 % of the smallest error of a lamp's place by the map.
double tolerance_px(const Rigid3& start, const Observations& observations, const Scene& scene,
                    const RefineOptions& options) {
  constexpr double share = 5e-3;
  double smallest_px = std::numeric_limits<double>::infinity();
  for (const LampObservation& lamp : observations.lamps) {
    if (!lamp.errors) return options.tolerance_px;
    const Eigen::Matrix2d covariance =
        image_covariance_px2(*lamp.lamp, start, scene.camera, lamp.errors);
    smallest_px = std::min(smallest_px, std::sqrt(covariance.trace() / 2));
  }
  return std::isfinite(smallest_px) ? std::max(options.tolerance_px, share * smallest_px)
                                    : options.tolerance_px;
}

/// `pose_only`: the covariance need not allow for a flat minimum.
Result<Refined> refine_with(const Rigid3& start, const std::vector<Match>& matches,
                            const std::vector<Blob>& blobs, const Scene& stated,
                            RefineOptions options, const ImageView* image, bool pose_only = false) {
  options.validate();
  require(start.rotation.allFinite() && start.translation.allFinite(), "start", start.matrix(),
          "finite");
  std::optional<Scene> corrected;  // the scene with model errors, and with estimated shared errors
  if (has_model_errors(options))
    corrected = with_model_errors(stated, matches, start, options);
  else if (has_shared_errors(stated))
    corrected = stated;
  const Scene& scene = corrected ? *corrected : stated;
  Observations observations = observe(matches, blobs, scene, options, image);
  options.tolerance_px = tolerance_px(start, observations, scene, options);
  Result<Refined> result;
  Refined& refined = result.value;
  State state{start};
  const int equations = observations.equations(options, options.rung);
  if (equations >= 6) {
    Minimum minimum =
        has_shared_errors(stated)
            ? minimise_with_shared_errors(state, matches, blobs, options, observations, *corrected)
            : find_minimum(state, observations, scene, options);
    if (!pose_only && minimum.converged && !observations.has_pixels() && may_be_flat(minimum)) {
      const Rung rung =
          observations.rim.empty() ? std::min(options.rung, Rung::centres) : Rung::rims;
      if (has_shared_errors(stated)) {
        SharedProfile profile(stated, matches, blobs, options, observations, scene, rung);
        widen_if_flat(
            [&](const State& at, PoseNormalEquations& to) { return profile.linearise(at, to); },
            minimum);
      } else {
        RefineProblem problem(observations, scene, options, rung);
        widen_if_flat(problem, minimum);
      }
    }
    state = minimum.state;
    refined.chi2 =
        minimum.normal.robust_chi2 +
        contradiction_chi2(observations, scene, state, options.rung, options.huber_sigma);
    refined.iterations = minimum.iterations;
    refined.dof = observations.degrees_of_freedom(options, options.rung) + minimum.normal.pixels;
    conclude(minimum, options, matches, observations.lamps, result);
  } else {
    refined.dof = observations.degrees_of_freedom(options, options.rung);
    result.status = Status::too_few_lamps;
    result.message = too_few_message(matches.size(), equations);
  }
  refined.cam_from_world = state.cam_from_world;
  if (!scene.camera.is_exact()) refined.estimated_camera = scene.camera;
  if (observations.has_pixels()) refined.psf_sigma_px = observations.psf_sigma_px;
  if (observations.growth_was_used()) refined.rim_growth_px = state.growth_px;
  if (observations.has_flux && options.flux == FluxModel::common_factor) {
    refined.flux_factor = std::exp(state.log_factor);
  }
  report_residuals(state, matches, observations, scene, options.rung, refined);
  return result;
}

}  // namespace

namespace {

/// Adds the error of the pose if the gradient of light that the scene predicts is absent.
void add_error_of_light(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                        const Scene& scene, const RefineOptions& options, const ImageView* image,
                        Result<Refined>& result) {
  if (!result.ok()) return;
  const Rigid3 pose = result->cam_from_world;
  const auto without = without_light_gradient(pose, matches, blobs, scene);
  if (!without) return;
  const Result<Refined> other = refine_with(pose, matches, *without, scene, options, image, true);
  if (other.ok()) add_pose_error(difference(other->cam_from_world, pose), result.value);
}

}  // namespace

Result<Refined> internal::refine::refine_as_stated(const Rigid3& start,
                                                   const std::vector<Match>& matches,
                                                   const std::vector<Blob>& measured,
                                                   const Scene& scene, const RefineOptions& options,
                                                   const ImageView* image) {
  // Below the rung rims, detection may not have measured any.
  const auto widened = uses_rims(options.rung)
                           ? with_errors_of_light(start, matches, measured, scene)
                           : std::nullopt;
  const std::vector<Blob>& blobs = widened ? *widened : measured;
  Result<Refined> result = refine_with(start, matches, blobs, scene, options, image);
  // The growth of over-exposed rims and the stated errors of few lamps can explain each other, so
  // that the estimates run away. The centres are always determined.
  const bool over_exposed = std::any_of(matches.begin(), matches.end(), [&](const Match& match) {
    return has_over_exposed_rim(blobs[static_cast<std::size_t>(match.blob)]);
  });
  if (result.status == Status::not_converged && over_exposed && uses_rims(options.rung) &&
      !is_exact(scene)) {
    RefineOptions by_centres = options;
    by_centres.rung = Rung::centres;
    Result<Refined> centres = refine_with(start, matches, blobs, scene, by_centres, nullptr);
    if (!centres.ok()) return result;
    centres.message =
        "the rims of over-exposed lamps do not converge with the stated errors: only their centres "
        "are used";
    add_error_of_light(matches, blobs, scene, by_centres, image, centres);
    return centres;
  }
  add_error_of_light(matches, blobs, scene, options, image, result);
  return result;
}

Result<Refined> refine(const Rigid3& start, const std::vector<Match>& matches,
                       const std::vector<Blob>& blobs, const Scene& scene,
                       const RefineOptions& options) {
  return with_estimated_map(refine_as_stated(start, matches, blobs, scene, options, nullptr),
                            matches, blobs, scene, options);
}

Result<Refined> refine(const Rigid3& start, const std::vector<Match>& matches,
                       const std::vector<Blob>& blobs, const Scene& scene,
                       const RefineOptions& options, const ImageView& image) {
  const Sensor sensor = scene.sensor.of_image(image);
  if (sensor.is_linear() != scene.sensor.is_linear()) {
    Scene coded = scene;
    coded.sensor = sensor;
    return refine(start, matches, blobs, coded, options, image);
  }
  return with_estimated_map(refine_as_stated(start, matches, blobs, scene, options, &image),
                            matches, blobs, scene, options);
}

}  // namespace occ
