// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/estimated_map.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/refine/internal/lamp_contradictions.hpp"
#include "libocc/refine/internal/light_errors.hpp"
#include "libocc/refine/internal/minimise.hpp"
#include "libocc/refine/internal/problem.hpp"

namespace occ::internal::refine {

double mean_distance_m(const Refined& refined, const Scene& scene) {
  double sum = 0;
  for (const LampResidual& lamp : refined.lamps)
    sum += (refined.cam_from_world * scene.lamps[lamp.match.lamp].centre_m).norm();
  return sum / static_cast<double>(std::max<std::size_t>(1, refined.lamps.size()));
}

double few_lamps_factor(int dof) { return square(student_quantile(0.99865, dof) / 3); }

LampContradiction contradiction_of(const std::vector<LampObservation>& lamps) {
  constexpr int of_shapes = 2;  // at most so many coordinates of the pose follow from the shapes
  double chi2 = 0;
  LampContradiction found;
  found.dof = -6;
  for (const LampObservation& lamp : lamps) {
    chi2 += lamp.own_chi2;
    found.dof += lamp.own_coordinates;
  }
  if (found.dof > 0 && variance_factor(chi2, found.dof + of_shapes) > 1)
    found.factor = chi2 / found.dof;
  return found;
}

namespace {

/// Contradictions (LampContradiction::factor) below the larger limit can also come from single rim
/// points, such as a beam in front of a lamp, and do not change the pose.
constexpr double min_contradiction = 4, clear_contradiction = 25;

/// Largest estimated error of the map, over the distance.
constexpr double max_map_error = 0.01;

bool uses(Rung rung, const Refined& refined) {
  return std::any_of(refined.lamps.begin(), refined.lamps.end(), [&](const LampResidual& lamp) {
    return !lamp.contradicts && lamp.rung == rung;
  });
}

/// True if the lamps in use are used by their rims, or by their centroids where they have none.
bool is_by_rims(const Refined& refined) {
  return uses(Rung::rims, refined) && !uses(Rung::direct, refined);
}

bool leaves_out_lamps(const Refined& refined) {
  return std::any_of(refined.lamps.begin(), refined.lamps.end(),
                     [](const LampResidual& lamp) { return lamp.contradicts; });
}

/// Contradiction of the lamps at this pose, by the rims; none if it cannot reach min_contradiction.
LampContradiction contradiction_at(const Refined& refined, const std::vector<Match>& matches,
                                   const std::vector<Blob>& blobs, const Scene& scene,
                                   const RefineOptions& options) {
  if (refined.variance_factor < min_contradiction) return {};  // contains that of the lamps
  Observations observations = observe(matches, blobs, scene, options);
  for (std::size_t i = 0; i < matches.size(); ++i)
    observations.lamps[i].contradicts = refined.lamps[i].contradicts;
  const State state{refined.cam_from_world, refined.rim_growth_px.value_or(0)};
  observations.move_rims(state.growth_px, scene.camera);
  RefineProblem problem(observations, scene, options, Rung::rims);
  const Minimum minimum = minimise(problem, state, options.max_iterations, options.tolerance_px);
  if (!minimum.defined) return {};
  std::vector<LampObservation> lamps = observations.lamps;
  problem.report_own_chi2(minimum.state, lamps);
  return contradiction_of(lamps);
}

/// Standard deviations of errors of the map with their degrees of freedom.
struct EstimatedErrors {
  double map_sigma_m = 0, size_sigma = 0;
  int dof = 0;
};

/// Distance of a lamp from its direction, by the residual of its centroid.
double centroid_error_m(const LampResidual& residual, const Refined& fit, const Scene& scene) {
  const double distance_m = (fit.cam_from_world * scene.lamps[residual.match.lamp].centre_m).norm();
  return residual.rms_px / scene.camera.fx_px() * distance_m;
}

/// Root mean square of the errors of position in a fit that leaves them free, or of those across
/// the lines of sight in a fit of centroids.
EstimatedErrors errors_of_positions(const Refined& fit, const Scene& scene) {
  double sum_m2 = 0;
  int dof = -6;
  for (const LampResidual& lamp : fit.lamps) {
    if (lamp.contradicts) continue;
    const bool by_rim = lamp.rung == Rung::rims;
    sum_m2 +=
        by_rim ? lamp.position_error_m.squaredNorm() : square(centroid_error_m(lamp, fit, scene));
    dof += by_rim ? 3 : 2;
  }
  return {std::sqrt(sum_m2 / std::max(1, dof)), 0, dof};
}

double rms_size_error(const Refined& fit) {
  double sum = 0;
  int lamps = 0;
  for (const LampResidual& lamp : fit.lamps) {
    if (lamp.contradicts) continue;
    sum += square(lamp.size_error);
    ++lamps;
  }
  return std::sqrt(sum / std::max(1, lamps));
}

/// An assignment and the fit of the scene as it is stated.
struct Problem {
  const Refined& exact;
  const std::vector<Match>& matches;
  const std::vector<Blob>& blobs;
  const Scene& scene;
  const RefineOptions& options;

  Result<Refined> fit(Rung rung, const EstimatedErrors& errors) const {
    return fit(rung, errors, exact.cam_from_world);
  }
  Result<Refined> fit(Rung rung, const EstimatedErrors& errors, const Rigid3& start) const {
    Scene wrong = errors.map_sigma_m > 0 ? with_map_errors(scene, errors.map_sigma_m) : scene;
    for (Lamp& lamp : wrong.lamps) lamp.size_sigma = std::max(lamp.size_sigma, errors.size_sigma);
    RefineOptions with_rung = options;
    with_rung.rung = rung;
    return refine_as_stated(start, matches, blobs, wrong, with_rung, nullptr);
  }
};

void enlarge(double factor, Refined& refined) {
  refined.covariance *= factor;
  refined.lamp_information /= factor;
  refined.lamp_gradient /= factor;
  refined.separation.variance_factor *= factor;
  refined.separation.position_covariance_m2 *= factor;
}

/// Enlarges the covariance by that of a fit with errors of the map, whose lamps have other weights.
void add_covariance(const Matrix6& covariance, Refined& refined) {
  const Matrix6 sum = refined.covariance + covariance;
  const auto variance_m2 = [&](const Matrix6& of_pose) {
    return position_covariance(refined.cam_from_world, of_pose).trace();
  };
  enlarge(variance_m2(sum) / variance_m2(refined.covariance), refined);
  refined.covariance = sum;
}

/// Fit with errors of the sizes; empty unless the directions agree with each other much better than
/// `map_sigma_m`, which is the misfit of directions and sizes.
std::optional<Refined> with_errors_of_sizes(const Problem& problem, double map_sigma_m) {
  constexpr int min_dof = 4;  // with four lamps, directions often agree by chance
  constexpr double free_size = 0.1, by_chance = 1e-3;
  const Result<Refined> centroids = problem.fit(Rung::centres, {});
  if (!centroids.ok()) return std::nullopt;
  const EstimatedErrors directions = errors_of_positions(*centroids, problem.scene);
  if (directions.dof < min_dof) return std::nullopt;
  const double much_better = student_quantile(1 - by_chance / 2, directions.dof);
  if (much_better * directions.map_sigma_m > map_sigma_m) return std::nullopt;
  const Rigid3& start = centroids->cam_from_world;
  const Result<Refined> free = problem.fit(Rung::rims, {0, free_size}, start);
  if (!free.ok()) return std::nullopt;
  Result<Refined> result = problem.fit(Rung::rims, {0, rms_size_error(*free)}, start);
  if (!result.ok()) return std::nullopt;
  result.value.estimated_size_sigma = rms_size_error(*free);
  enlarge(std::max(few_lamps_factor(directions.dof), centroids->variance_factor), result.value);
  return std::move(result.value);
}

/// Contradiction of all lamps without errors of the lens, also of those that the fit leaves out.
LampContradiction contradiction_of_all(const Problem& problem) {
  RefineOptions options = problem.options;
  options.huber_sigma = std::numeric_limits<double>::infinity();
  const Result<Refined> fit = refine_as_stated(problem.exact.cam_from_world, problem.matches,
                                               problem.blobs, problem.scene, options, nullptr);
  return fit.ok() ? contradiction_at(*fit, problem.matches, problem.blobs, problem.scene, options)
                  : LampContradiction{};
}

/// Ratio (F) of the mean reductions of chi2 by one or two more parameters and of the rest that
/// errors of the positions exceed by chance once in ten thousand fits. Infinite without a rest.
double improvement_by_chance(int parameters, int rest) {
  constexpr double probability = 1e-4;
  if (rest < 1) return std::numeric_limits<double>::infinity();
  if (parameters == 1) return square(student_quantile(1 - probability / 2, rest));
  return 0.5 * rest * (std::pow(probability, -2.0 / rest) - 1);
}

/// Fit with an error that is common to all lamps.
struct CommonCause {
  Refined refined;
  bool is_decisive = false;  ///< the lamps agree with each other much better than by chance
};

/// Empty unless all lamps agree with each other in the fit of a scene with one or two more
/// unknowns.
std::optional<CommonCause> common_cause(const Problem& problem, const LampContradiction& all,
                                        int parameters) {
  Result<Refined> fit = refine_as_stated(problem.exact.cam_from_world, problem.matches,
                                         problem.blobs, problem.scene, problem.options, nullptr);
  const bool fits = fit.ok() && is_by_rims(*fit) && !leaves_out_lamps(*fit) &&
                    fit->variance_factor < min_contradiction;
  if (!fits) return std::nullopt;
  const int rest = all.dof - parameters;
  const double reduction = all.factor * all.dof - fit->variance_factor * rest;
  const double by_chance = parameters * improvement_by_chance(parameters, rest);
  const bool is_decisive = reduction > by_chance * fit->variance_factor;
  return CommonCause{std::move(fit.value), is_decisive};
}

/// Growth of the outlines: blur, or a response that is not stated. Saturated ones always may grow.
std::optional<CommonCause> with_growth(const Problem& problem, const LampContradiction& all) {
  if (problem.exact.rim_growth_px) return std::nullopt;
  RefineOptions options = problem.options;
  options.outlines_grow = true;
  auto cause =
      common_cause({problem.exact, problem.matches, problem.blobs, problem.scene, options}, all, 1);
  if (cause) cause->refined.estimated_growth_px = cause->refined.rim_growth_px;
  return cause;
}

/// Errors of a lens that was not calibrated: of the focal length, or of k1 as well. Empty for a
/// camera of another model, or whose errors are stated.
std::optional<CommonCause> with_errors_of_lens(const Problem& problem,
                                               const LampContradiction& all) {
  constexpr double focal_sigma = 0.03, k1_sigma = 0.1;
  const Camera& camera = problem.scene.camera;
  const bool has_k1 = camera.kind() == CameraKind::pinhole || camera.kind() == CameraKind::fisheye;
  if (!camera.is_exact() || !has_k1) return std::nullopt;
  std::optional<CommonCause> found;
  std::map<std::string, double> sigmas{{"f_px", focal_sigma * camera.fx_px()}};
  for (const int parameters : {1, 2}) {
    if (parameters == 2) sigmas["k1"] = k1_sigma;
    Scene scene = problem.scene;
    scene.camera = camera.with_parameter_sigmas(sigmas);
    auto cause = common_cause(
        {problem.exact, problem.matches, problem.blobs, scene, problem.options}, all, parameters);
    if (cause && (!found || cause->is_decisive)) found = std::move(cause);
    if (found && found->is_decisive) break;
  }
  return found;
}

/// Causes that are common to all lamps and that explain their contradictions, the best one first.
std::vector<CommonCause> common_causes(const Problem& problem) {
  const LampContradiction all = contradiction_of_all(problem);
  std::vector<CommonCause> causes;
  for (auto cause : {with_growth(problem, all), with_errors_of_lens(problem, all)})
    if (cause) causes.push_back(*std::move(cause));
  std::stable_sort(causes.begin(), causes.end(), [](const CommonCause& a, const CommonCause& b) {
    if (a.is_decisive != b.is_decisive) return a.is_decisive;
    return a.refined.chi2 < b.refined.chi2;
  });
  return causes;
}

/// Fit with errors of the positions, or of the sizes if they are the cause. In a fit with errors of
/// 1 % of the distance, the noise of the rims is negligible: the lamps' errors are then the
/// residuals of a least-squares fit of their positions. Over-exposed rims may be given up in it for
/// the centroids. Empty if the errors are larger or not determined.
std::optional<Refined> with_errors_of_residuals(const Problem& problem) {
  const double max_sigma_m = max_map_error * mean_distance_m(problem.exact, problem.scene);
  const Result<Refined> loose = problem.fit(Rung::rims, {max_sigma_m});
  if (!loose.ok()) return with_errors_of_sizes(problem, max_sigma_m);
  if (uses(Rung::direct, *loose)) return std::nullopt;
  const EstimatedErrors errors = errors_of_positions(*loose, problem.scene);
  if (errors.dof < 1 || !(errors.map_sigma_m > 0)) return std::nullopt;
  if (auto sized = with_errors_of_sizes(problem, errors.map_sigma_m)) return sized;
  if (errors.map_sigma_m > max_sigma_m) return std::nullopt;
  Result<Refined> result = problem.fit(Rung::rims, errors, loose->cam_from_world);
  if (!result.ok()) {
    result = loose;
    enlarge(square(errors.map_sigma_m / max_sigma_m), result.value);
  }
  result.value.estimated_map_sigma_m = errors.map_sigma_m;
  enlarge(few_lamps_factor(errors.dof), result.value);
  return std::move(result.value);
}

/// The fit, with the misfit of the scene as it is stated.
Refined with_misfit_of(const Refined& exact, Refined fit) {
  fit.chi2 = exact.chi2;
  fit.dof = exact.dof;
  fit.variance_factor = exact.variance_factor;
  return fit;
}

}  // namespace

Scene with_map_errors(Scene scene, double sigma_m) {
  for (Lamp& lamp : scene.lamps) {
    const Eigen::Vector3d stated_m =
        scene.position_sigma_m(lamp).value_or(PerAxis(Eigen::Vector3d::Zero()));
    lamp.position_sigma_m = Eigen::Vector3d(stated_m.cwiseMax(sigma_m));
  }
  return scene;
}

Result<Refined> with_estimated_map(const Result<Refined>& exact, const std::vector<Match>& matches,
                                   const std::vector<Blob>& blobs, const Scene& scene,
                                   const RefineOptions& options) {
  const bool may_have_errors = options.model_sigma_px == 0 && std::isfinite(options.huber_sigma);
  if (!exact.ok() || !may_have_errors || !is_by_rims(*exact) || exact->estimated_size_sigma)
    return exact;
  const double contradiction = contradiction_at(*exact, matches, blobs, scene, options).factor;
  if (contradiction < min_contradiction && !leaves_out_lamps(*exact)) return exact;
  Result<Refined> result = exact;
  const Problem problem{*exact, matches, blobs, scene, options};
  std::vector<CommonCause> causes = common_causes(problem);
  const bool is_explained = !causes.empty() && causes.front().is_decisive;
  if (is_explained) {
    result.value = with_misfit_of(*exact, std::move(causes.front().refined));
    causes.erase(causes.begin());
  } else if (contradiction < min_contradiction) {
    return exact;
  }
  if (contradiction >= min_contradiction && contradiction < clear_contradiction) {
    if (const auto estimated = with_errors_of_residuals(problem))
      add_covariance(estimated->covariance, result.value);
  } else if (!is_explained) {
    if (auto estimated = with_errors_of_residuals(problem)) {
      result.value = with_misfit_of(*exact, *std::move(estimated));
    } else {
      // No covariance describes the error of this pose.
      result.status = Status::not_converged;
      result.message =
          "the lamps contradict each other by more than errors of 1 % of their distance: check the "
          "map, the radii, the camera, and which lamp is which";
    }
  }
  const Rigid3 pose = result->cam_from_world;
  for (const CommonCause& cause : causes)
    if (cause.is_decisive || !is_explained)
      add_pose_error(difference(cause.refined.cam_from_world, pose), result.value);
  return result;
}

std::optional<Refined> with_estimated_sizes(const Refined& exact, const std::vector<Match>& matches,
                                            const std::vector<Blob>& blobs, const Scene& scene,
                                            const RefineOptions& options) {
  constexpr double max_size = 0.2;
  if (options.model_sigma_px > 0 || !is_by_rims(exact)) return std::nullopt;
  auto sized = with_errors_of_sizes({exact, matches, blobs, scene, options},
                                    max_map_error * mean_distance_m(exact, scene));
  if (!sized || !(*sized->estimated_size_sigma <= max_size)) return std::nullopt;
  return with_misfit_of(exact, *std::move(sized));
}

}  // namespace occ::internal::refine
