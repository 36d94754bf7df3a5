// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/free_outline.hpp"
#include "libocc/detect/internal/plateau.hpp"
#include "libocc/detect/internal/rim_profiles.hpp"
#include "libocc/detect/internal/rim_tail.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

constexpr int max_free_passes = 8;
constexpr double settled_blur_px = 0.01;
constexpr std::size_t min_free_points = 8;
// Error of the whole rim and of its parts by the model of an edge, see edge_model_px in
// polygon_rim.cpp.
constexpr double free_edge_model_px = 0.001;
// Blur of a clipped edge, for the reach of its corners and parabolas.
constexpr double saturated_blur_px = 1.2;

/// Joins the measured points, with sigmas that are inflated to the observed scatter.
FreeRim finish(const FreeOutline& outline, FreeOutline::Fitted fitted) {
  FreeRim rim;
  rim.points = std::move(fitted.points);
  rim.centre_px = outline.centroid_px();
  rim.second_moments_px2 = outline.second_moments_px2();
  rim.is_convex = outline.is_convex();
  const double excess =
      fitted.dof < 1 ? 1 : std::max(1.0, fitted.chi2 / fitted.dof - std::sqrt(2 / fitted.dof));
  for (RimPoint& point : rim.points) point.sigma_px *= std::sqrt(excess);
  rim.centre_covariance_px2 = excess * outline.centroid_covariance_px2();
  rim.common_covariance_px2.diagonal().array() += square(free_edge_model_px);
  return rim;
}

}  // namespace

std::optional<FreeRim> measure_free_rim(const Patch& patch, const Component& component,
                                        double blur_px) {
  const double lens_blur_px = blur_px;
  double level = 0.5 * weighted_mean_signal(patch, component);
  for (int pass = 0; pass < max_free_passes; ++pass) {
    // Traced in each pass: level and blur change.
    std::optional<FreeOutline> outline = FreeOutline::trace(patch, component, level, blur_px);
    if (!outline) return std::nullopt;
    outline->measure_depths(patch, level, blur_px);
    const std::optional<Plateau> plateau = Plateau::fit(patch, *outline, blur_px);
    if (!plateau || !(plateau->level() > 0)) return std::nullopt;
    level = 0.5 * plateau->level();
    const RimModel model{*plateau, noise_of(patch, *plateau), blur_px};
    RimProfiles profiles(patch, model, outline->centroid_px());
    std::vector<std::optional<RimPoint>> points;
    for (const RimLine& line : outline->lines()) {
      const std::size_t before = profiles.points.size();
      profiles.add(line);
      points.push_back(profiles.points.size() > before ? std::optional(profiles.points.back())
                                                       : std::nullopt);
    }
    if (profiles.points.size() < min_free_points) return std::nullopt;
    const double blur = std::clamp(blur_px * (1 + std::clamp(profiles.blur_change(), -0.4, 0.6)),
                                   min_blur_px, max_blur_px);
    const bool settled = pass > 0 && std::abs(blur - blur_px) < settled_blur_px;
    if (!settled) {
      blur_px = blur;
      continue;
    }
    if (profiles.misfit() > max_misfit) return std::nullopt;
    outline->replace(points, blur_px);
    FreeOutline::Fitted fitted = outline->fitted();
    if (fitted.points.size() < min_free_points) return std::nullopt;
    FreeRim rim = finish(*outline, std::move(fitted));
    const Eigen::Matrix2d response = shift_response(profiles.points, profiles.by_gradient);
    const double growth = profiles.by_level / static_cast<double>(profiles.points.size());
    if (plateau->uniform()) rim.light_response_px2 = -plateau->level() * response;
    const RimErrorCovariance by_plateau = plateau_errors(model, growth, response);
    rim.common_covariance_px2 += by_plateau;
    rim.centre_covariance_px2 += by_plateau.block<2, 2>(1, 1);
    add_uneven_light(model, profiles, rim.common_covariance_px2, rim.centre_covariance_px2);
    add_softness(soft_growth_px(blur_px, lens_blur_px), std::sqrt(outline->area_px2() / pi),
                 rim.common_covariance_px2, rim.centre_covariance_px2);
    return rim;
  }
  return std::nullopt;
}

std::optional<FreeRim> measure_saturated_free_rim(const Patch& patch, const Component& component) {
  const double level = rim_level * patch.full_scale_signal();
  if (!(level > 0)) return std::nullopt;
  std::optional<FreeOutline> outline =
      FreeOutline::trace(patch, component, level, saturated_blur_px);
  if (!outline) return std::nullopt;
  const std::vector<RimLine> crossed = outline->lines();
  if (crossed.size() < min_free_points) return std::nullopt;
  const auto lines = [&](auto&& f) { std::for_each(crossed.begin(), crossed.end(), f); };
  const Tail tail = fit_tail(patch, lines, level);
  if (!(tail.slope > 0) || !std::isfinite(tail.bend)) return std::nullopt;
  std::vector<std::optional<RimPoint>> points;
  for (const RimLine& line : crossed) {
    const std::vector<RimPoint> own = fit_points(
        patch, [&](auto&& f) { f(line); }, tail, level);
    points.push_back(own.empty() ? std::nullopt : std::optional(own.front()));
  }
  outline->replace(points, saturated_blur_px);
  FreeOutline::Fitted fitted = outline->fitted();
  if (fitted.points.size() < min_free_points) return std::nullopt;
  FreeRim rim = finish(*outline, std::move(fitted));
  const double radius_px = std::sqrt(outline->area_px2() / pi);
  add_unclipped_part(patch, component, rim.points, rim.centre_covariance_px2);
  rim.point_response = tail.light_response(radius_px);
  rim.light_response_px2 =
      shift_response(rim.points, rim.point_response.moves(rim.points, rim.centre_px));
  add_saturated_shift(tail_misfit(patch, lines, tail, level), tail.is_halo(radius_px),
                      rim.light_response_px2, rim.common_covariance_px2, rim.centre_covariance_px2);
  return rim;
}

}  // namespace occ::internal::detect
