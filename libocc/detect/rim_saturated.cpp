// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/rim_tail.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

constexpr double min_saturated_minor_px = 2;  // min semi-minor axis

/// Moves the points of a narrow ring to where the signal has the same share of the peak near each
/// of them. The peak varies linearly around the ring. Empty if its points determine no ellipse.
std::optional<EllipseFit> follow_peak(const Patch& patch, const Tail& tail,
                                      const FittedConic& conic, std::vector<RimPoint>& points) {
  constexpr double max_width_px = 6, step_px = 0.5, min_share = 0.2;
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const auto row_at = [&](const RimPoint& point) {
    const Eigen::Vector2d off = point.px - conic.centre;
    return Eigen::Vector3d(1, off.x(), off.y());
  };
  for (const RimPoint& point : points) {
    double peak = 0;
    for (double depth = 0; depth <= max_width_px; depth += step_px)
      peak = std::max(peak, patch.interpolated(point.px - depth * point.normal).value_or(0));
    normal += row_at(point) * row_at(point).transpose();
    right += peak * row_at(point);
  }
  const Eigen::Vector3d peak = core::solve_ldlt(normal, right);
  for (RimPoint& point : points) {
    const double share = std::max(min_share, row_at(point).dot(peak) / peak[0]);
    point.px -= std::log(share) / tail.slope * point.normal;
  }
  return fit_ellipse(points, conic);
}

/// Measures where the signal falls to a level, or to that share of a narrow ring's peak. `conic`:
/// the ellipse of the crossings of the level.
std::optional<Rim> measure_rim_at(const Patch& patch, FittedConic conic, double level,
                                  bool is_narrow) {
  Rim rim;
  double last_rim_px = 0;
  for (int pass = 0; pass < max_saturated_passes; ++pass) {
    if (conic.ellipse().semi_minor_px < min_saturated_minor_px) return std::nullopt;
    const auto lines = [&](auto&& f) { for_each_rim_line(conic, f); };
    const Tail tail = fit_tail(patch, lines, level);
    if (!(tail.slope > 0) || !std::isfinite(tail.bend)) return std::nullopt;
    rim.points = fit_points(patch, lines, tail, level);
    const std::optional<EllipseFit> fit = fit_ellipse(rim.points, conic);
    if (!fit) return std::nullopt;
    // The level remains a little off the ellipse if the lens deforms the rim.
    const bool settled = (fit->conic.centre - conic.centre).norm() < saturated_settled_px &&
                         std::abs(tail.rim() - last_rim_px) < saturated_settled_px;
    last_rim_px = tail.rim();
    conic = fit->conic;
    rim.fit = *fit;
    if (settled) {
      if (is_narrow) {
        const std::optional<EllipseFit> followed = follow_peak(patch, tail, conic, rim.points);
        if (!followed) return std::nullopt;
        rim.fit = *followed;
      } else {
        // With light that is stronger by a relative amount p, the rim at a fixed level is p / decay
        // further outside.
        rim.point_response = tail.light_response(conic.ellipse().semi_minor_px);
      }
      align_normals(rim);
      rim.light_response_px2 =
          centre_response(rim.points, conic, rim.point_response.moves(rim.points, conic.centre));
      inflate_sigmas(rim);
      add_saturated_shift(tail_misfit(patch, lines, tail, level),
                          tail.is_halo(conic.ellipse().semi_minor_px), rim.light_response_px2,
                          rim.common_covariance_px2, rim.fit.centre_covariance_px2);
      if (!tail.is_halo(conic.ellipse().semi_minor_px)) {
        // Blur of sigma s moves a rim of radius R by s^2 / 2 R, more where it is more curved. The
        // square of s is the product of the tail's depth and response.
        constexpr double uneven = 0.2;  // part of it that differs around the rim
        const double bend_px = tail.depth() / tail.slope / (2 * conic.ellipse().semi_minor_px);
        rim.common_covariance_px2.diagonal().tail<2>().array() += square(uneven * bend_px);
      }
      return rim;
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<Rim> measure_saturated_rim(const Patch& patch, const Component& component) {
  const double level = rim_level * patch.full_scale_signal();
  if (!(level > 0)) return std::nullopt;
  const std::optional<Outline> outline = find_outline(patch, component, level);
  if (!outline) return std::nullopt;
  if (outline->merged) {
    Rim rim;
    rim.merged = true;
    return rim;
  }
  std::optional<Rim> rim = measure_rim_at(patch, outline->conic, level, false);
  if (rim) add_unclipped_part(patch, component, rim->points, rim->fit.centre_covariance_px2);
  return rim;
}

std::optional<Rim> measure_narrow_ring(const Patch& patch, const FittedConic& outline,
                                       double level) {
  constexpr double growth_px = 0.5;  // 0.1 for a width of six sigmas of the blur, 0.9 for none
  constexpr double shift_px = 0.03;  // rings whose light varies by 20 % about its mean: 0.01 to 0.1
  std::optional<Rim> rim = measure_rim_at(patch, outline, level, true);
  if (!rim) return rim;
  rim->common_covariance_px2(0, 0) += square(growth_px);
  rim->common_covariance_px2.diagonal().tail<4>().array() += square(shift_px);
  rim->fit.centre_covariance_px2.diagonal().array() += square(shift_px);
  return rim;
}

}  // namespace occ::internal::detect
