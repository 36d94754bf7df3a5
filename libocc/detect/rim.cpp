// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/plateau.hpp"
#include "libocc/detect/internal/rim_profiles.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

constexpr int max_sharp_passes = 6, max_rim_passes = 15;  // without and with defocus
constexpr double settled_px = 0.005;  // convergence limit for centre, size and blur
constexpr double min_minor_px = 3;    // as min_rim_px in measure.cpp

/// Geometric mean of the semi-axes.
double size_of(const FittedConic& conic) { return std::pow(conic.shape.determinant(), -0.25); }

/// Adds the errors of the estimated plateau.
void add_plateau_noise(const RimModel& model, const RimProfiles& profiles, Rim& rim) {
  const Eigen::Matrix2d response = centre_response(rim.points, rim.fit.conic, profiles.by_gradient);
  const double growth = profiles.by_level / static_cast<double>(rim.points.size());
  if (model.plateau.uniform()) rim.light_response_px2 = -model.plateau.level() * response;
  rim.common_covariance_px2 = plateau_errors(model, growth, response);
  rim.fit.centre_covariance_px2 += rim.common_covariance_px2.block<2, 2>(1, 1);
}

}  // namespace

void align_normals(Rim& rim) {
  for (RimPoint& point : rim.points)
    point.normal = (rim.fit.conic.shape * (point.px - rim.fit.conic.centre)).normalized();
}

void inflate_sigmas(Rim& rim) {
  const double dof = std::max(1, rim.fit.dof);
  const double excess = rim.fit.chi2 / dof - std::sqrt(2 / dof);
  if (!(excess > 1)) return;
  for (RimPoint& point : rim.points) point.sigma_px *= std::sqrt(excess);
  rim.fit.centre_covariance_px2 *= excess;
  rim.common_covariance_px2 *= excess;
  rim.fit.chi2 /= excess;
}

namespace {

/// Size of the dark middle of a ring lamp, relative to the ellipse of its outer rim: the part from
/// which on it is bright. 0 for a disc.
double hole_of(const Patch& patch, const FittedConic& conic) {
  constexpr int rays = 12, max_steps = 24, step_px = 2;
  constexpr double dark = 0.25, dark_sigmas = 4;  // dimmer by: of the level, of the noise
  const Eigen::Matrix2d of_circle = ellipse_from_circle(conic);
  const int steps =
      std::clamp(static_cast<int>(conic.ellipse().semi_minor_px) / step_px, 1, max_steps);
  std::array<Eigen::Vector2d, rays> step;  // from the centre to the rim
  for (int k = 0; k < rays; ++k) {
    const double angle = 2 * pi * k / rays;
    step[static_cast<std::size_t>(k)] =
        of_circle * Eigen::Vector2d(std::cos(angle), std::sin(angle)) / steps;
  }
  double brightest = 0;
  for (int i = steps; i >= 0; --i) {  // from the rim inwards
    double sum = 0;
    int seen = 0;
    for (const Eigen::Vector2d& by : step) {
      const int x = static_cast<int>(conic.centre.x() + i * by.x() + 0.5);
      const int y = static_cast<int>(conic.centre.y() + i * by.y() + 0.5);
      if (!patch.contains(x, y)) continue;
      sum += *patch.at(x, y);
      ++seen;
    }
    if (seen == 0) continue;
    const double level = sum / seen, drop = brightest - level;
    if (drop > dark * brightest &&
        drop > dark_sigmas * std::sqrt(patch.noise().variance(brightest)))
      return (i + 1.0) / steps;
    brightest = std::max(brightest, level);
  }
  return 0;
}

/// Fits the rim, starting from the outline. `hole`: hole_of(). `dazzled`: share of the lines that
/// were left out because of light outside the rim.
std::optional<Rim> fit_rim(const Patch& patch, FittedConic conic, double hole, double blur_px,
                           bool glow, double& dazzled) {
  Rim rim;
  rim.blur_px = blur_px;
  dazzled = 0;
  for (int pass = 0; pass < max_rim_passes; ++pass) {
    if (conic.ellipse().semi_minor_px < min_minor_px) return std::nullopt;
    const std::optional<Plateau> plateau = Plateau::fit(patch, conic, rim.blur_px, hole);
    if (!plateau || !(plateau->level() > 0)) return std::nullopt;
    const RimModel model{*plateau, noise_of(patch, *plateau), rim.blur_px};
    RimProfiles profiles(patch, model, conic.centre, glow);
    for_each_rim_line(conic, [&](const RimLine& line) { profiles.add(line); });
    const auto measured = static_cast<double>(profiles.points.size());
    if (profiles.dazzled > 0) dazzled = profiles.dazzled / (profiles.dazzled + measured);
    const std::optional<EllipseFit> fit = fit_ellipse(profiles.points, conic);
    if (!fit) return std::nullopt;
    const double blur = rim.blur_px * (1 + std::clamp(profiles.blur_change(), -0.4, 0.6));
    const bool settled = (fit->conic.centre - conic.centre).norm() < settled_px &&
                         std::abs(size_of(fit->conic) - size_of(conic)) < settled_px &&
                         std::abs(blur - rim.blur_px) < settled_px;
    conic = fit->conic;
    rim.fit = *fit;
    rim.points = profiles.points;
    if (settled) {
      if (profiles.misfit() > max_misfit) return std::nullopt;
      align_normals(rim);
      add_plateau_noise(model, profiles, rim);
      add_uneven_light(model, profiles, rim.common_covariance_px2, rim.fit.centre_covariance_px2);
      inflate_sigmas(rim);
      add_softness(soft_growth_px(rim.blur_px, blur_px), size_of(rim.fit.conic),
                   rim.common_covariance_px2, rim.fit.centre_covariance_px2);
      return rim;
    }
    if (pass + 1 >= max_sharp_passes && profiles.misfit() > max_misfit) return std::nullopt;
    rim.blur_px = std::clamp(blur, min_blur_px, max_blur_px);
  }
  return std::nullopt;
}

}  // namespace

std::optional<Rim> measure_rim(const Patch& patch, const Component& component, double blur_px) {
  constexpr double mostly = 0.25;  // of the lines are dazzled: not a neighbour, but a bezel
  const double level = 0.5 * weighted_mean_signal(patch, component);
  const std::optional<Outline> outline = find_outline(patch, component, level);
  if (!outline) return std::nullopt;
  if (outline->merged) {
    Rim rim;
    rim.merged = true;
    return rim;
  }
  const FittedConic& conic = outline->conic;
  const double hole = hole_of(patch, conic);
  double dazzled = 0;
  std::optional<Rim> rim = fit_rim(patch, conic, hole, blur_px, false, dazzled);
  if (!rim && dazzled > mostly) rim = fit_rim(patch, conic, hole, blur_px, true, dazzled);
  if (!rim && hole > 0) rim = measure_narrow_ring(patch, conic, level);
  return rim;
}

}  // namespace occ::internal::detect
