// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/rim_tail.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

constexpr double min_saturated_minor_px = 2;  // min semi-minor axis

}  // namespace

std::optional<Rim> measure_saturated_rim(const Patch& patch, const Component& component) {
  const double level = rim_level * patch.full_scale_signal();
  if (!(level > 0)) return std::nullopt;
  const std::optional<Outline> outline = find_outline(patch, component, level);
  if (!outline) return std::nullopt;
  Rim rim;
  rim.merged = outline->merged;
  if (rim.merged) return rim;
  FittedConic conic = outline->conic;
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
      align_normals(rim);
      // With light that is stronger by a relative amount p, the rim at a fixed level is p / decay
      // further outside.
      rim.point_response = tail.light_response(conic.ellipse().semi_minor_px);
      rim.light_response_px2 =
          centre_response(rim.points, conic, rim.point_response.moves(rim.points, conic.centre));
      inflate_sigmas(rim);
      add_saturated_shift(tail_misfit(patch, lines, tail, level),
                          tail.is_halo(conic.ellipse().semi_minor_px), rim.light_response_px2,
                          rim.common_covariance_px2, rim.fit.centre_covariance_px2);
      return rim;
    }
  }
  return std::nullopt;
}

}  // namespace occ::internal::detect
