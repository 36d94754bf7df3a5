// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

// Only the tail of the edge is below full scale. Its shape is estimated from the blob itself
// instead of a PSF: the logarithm of the signal around the whole rim is a parabola in the distance
// from the rim.
constexpr double dimmest_used = 0.03;              // of full scale; the brightest is clipped_share
constexpr double inside_px = 1.5, outside_px = 4;  // window about the rim
constexpr double rim_level = 0.5;                  // signal at the rim, of full scale
constexpr int max_saturated_passes = 8;
constexpr double saturated_settled_px = 0.003;  // limit of the last change of centre and level
constexpr double min_saturated_minor_px = 2;    // min semi-minor axis

/// ln(signal / level at the rim) = offset - slope t - bend t^2, t pixels outside the rim.
struct Tail {
  double offset = 0, slope = 1.5, bend = 0.3;

  double signal(double level, double t) const {
    return level * std::exp(offset - t * (slope + bend * t));
  }
  double decay(double t) const { return slope + 2 * bend * t; }

  /// Mean distance inside the rim of the source of the light observed at the rim. Under a Gaussian
  /// blur of sigma s at z = t / s, with the hazard h of the normal distribution, the decay is h / s
  /// and its derivative h (h - z) / s^2. A linear gradient appears as it is s h further inside. h
  /// is approximated from both to 0.03.
  double depth() const {
    const double ratio = std::max(2 * bend, 0.0) / square(slope);  // (h - z) / h
    const double hazard = std::clamp(1 / std::sqrt(ratio) - 0.17, 0.2, 5.0);
    return square(hazard) / slope;
  }

  /// Distance at which the signal has the rim's level; small when the ellipse has converged.
  double rim() const { return std::clamp(offset / decay(0.5 * offset / slope), -1.0, 1.0); }
};

struct Sample {
  double t, signal;
};

/// Calls f(distance from the rim, signal) for the samples of a line that are neither clipped nor
/// close to the background.
template <typename F>
void for_each_sample(const Patch& patch, const RimLine& line, F&& f) {
  const double cosine = line.cosine(), outward = line.outward;
  const double inner = line.edge - outward * inside_px / cosine;
  const double outer = line.edge + outward * outside_px / cosine;
  const int low = static_cast<int>(std::ceil(std::min(inner, outer)));
  const int high = static_cast<int>(std::floor(std::max(inner, outer)));
  if (!line.inside(patch, low, high)) return;
  const float* pixel = line.pixel(patch, low);
  const double curvature = std::abs(line.bend) * cosine * cosine * cosine;
  const double full = patch.full_scale_signal();
  for (int along = low; along <= high; ++along, pixel += line.step(patch)) {
    const double signal = *pixel;
    if (!(signal < clipped_share * full && signal > dimmest_used * full)) continue;
    const double d = outward * (along - line.edge);
    f(d * cosine + 0.5 * curvature * square(d) * (1 - square(cosine)), signal);
  }
}

Tail fit_tail(const Patch& patch, const FittedConic& conic, double level) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for_each_rim_line(conic, [&](const RimLine& line) {
    for_each_sample(patch, line, [&](double t, double signal) {
      const Eigen::Vector3d row(1, -t, -t * t);
      const double weight = square(signal) / patch.noise().variance(signal);
      normal += weight * row * row.transpose();
      right += weight * std::log(signal / level) * row;
    });
  });
  const Eigen::Vector3d s = core::solve_ldlt(normal, right);
  Tail tail;
  tail.offset = s[0];
  tail.slope = s[1];
  tail.bend = s[2];
  return tail;
}

/// Fits one rim point on each line: the least-squares shift of the tail.
std::vector<RimPoint> fit_points(const Patch& patch, const FittedConic& conic, const Tail& tail,
                                 double level) {
  std::vector<RimPoint> points;
  for_each_rim_line(conic, [&](const RimLine& line) {
    double numerator = 0, denominator = 0;
    for_each_sample(patch, line, [&](double t, double signal) {
      const double model = tail.signal(level, t);
      const double weight = 1 / patch.noise().variance(model);
      const double slope = model * tail.decay(t);
      numerator += weight * slope * (signal - model);
      denominator += weight * slope * slope;
    });
    if (!(denominator > 0)) return;
    const double shift = numerator / denominator + tail.rim();
    points.push_back({line.point(line.edge + line.outward * shift / line.cosine()), line.normal(),
                      1 / std::sqrt(denominator)});
  });
  return points;
}

/// Response of the centre to a gradient of the lamp's light. Where the light is stronger by a
/// relative amount p, the rim at a fixed level is p / decay further outside.
Eigen::Matrix2d light_response(const Rim& rim, const Tail& tail) {
  std::vector<Eigen::Vector2d> moves;
  for (const RimPoint& point : rim.points)
    moves.push_back((point.px - tail.depth() * point.normal - rim.fit.conic.centre) / tail.slope);
  return centre_response(rim.points, rim.fit.conic, moves);
}

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
    const Tail tail = fit_tail(patch, conic, level);
    if (!(tail.slope > 0) || !std::isfinite(tail.bend)) return std::nullopt;
    rim.points = fit_points(patch, conic, tail, level);
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
      rim.light_response_px2 = light_response(rim, tail);
      inflate_sigmas(rim);
      return rim;
    }
  }
  return std::nullopt;
}

}  // namespace occ::internal::detect
