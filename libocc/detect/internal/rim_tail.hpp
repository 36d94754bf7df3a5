// SPDX-License-Identifier: Apache-2.0
// Internal: rim points of a lamp of which only the tail of the edge is used: it is clipped at full
// scale, or so narrow that there is nothing but edges.
//
// The shape of the tail is estimated from the blob itself instead of a PSF: the logarithm of the
// signal around the whole rim is a parabola in the distance from the rim.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/outline.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {

inline constexpr double dimmest_used =
    0.03;  ///< part of full scale or of the peak; the brightest is clipped_share
inline constexpr double inside_px = 1.5, outside_px = 4;  ///< window about the rim
inline constexpr double rim_level = 0.5;  ///< signal at the rim, of full scale or of the peak
inline constexpr int max_saturated_passes = 8;
inline constexpr double saturated_settled_px = 0.003;  ///< limit of the last change

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

  /// True for the halo of a strongly over-exposed lamp, which is no tail of a Gaussian: it decays
  /// so slowly that its light would come from beyond the centre.
  bool is_halo(double radius_px) const { return depth() > radius_px; }

  /// depth(), or half of the lamp's radius for a halo, whose light comes from all over the lamp.
  double depth_within(double radius_px) const {
    return is_halo(radius_px) ? 0.5 * radius_px : depth();
  }

  RimLightResponse light_response(double radius_px) const {
    return {1 / slope, depth_within(radius_px)};
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
void for_each_sample(const Patch& patch, const RimLine& line, double level, F&& f) {
  const double cosine = line.cosine(), outward = line.outward;
  const double inner = line.edge - outward * inside_px / cosine;
  const double outer = line.edge + outward * outside_px / cosine;
  const int low = static_cast<int>(std::ceil(std::min(inner, outer)));
  const int high = static_cast<int>(std::floor(std::max(inner, outer)));
  if (!line.inside(patch, low, high)) return;
  const float* pixel = line.pixel(patch, low);
  const double curvature = std::abs(line.bend) * cosine * cosine * cosine;
  const double full = level / rim_level;
  for (int along = low; along <= high; ++along, pixel += line.step(patch)) {
    const double signal = *pixel;
    if (!(signal < clipped_share * full && signal > dimmest_used * full)) continue;
    const double d = outward * (along - line.edge);
    f(d * cosine + 0.5 * curvature * square(d) * (1 - square(cosine)), signal);
  }
}

/// `lines(f)` calls f for each line across the rim.
template <typename Lines>
Tail fit_tail(const Patch& patch, const Lines& lines, double level) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  lines([&](const RimLine& line) {
    for_each_sample(patch, line, level, [&](double t, double signal) {
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
template <typename Lines>
std::vector<RimPoint> fit_points(const Patch& patch, const Lines& lines, const Tail& tail,
                                 double level) {
  std::vector<RimPoint> points;
  lines([&](const RimLine& line) {
    double numerator = 0, denominator = 0;
    for_each_sample(patch, line, level, [&](double t, double signal) {
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

/// Mean square of the samples' residuals over their variance.
template <typename Lines>
double tail_misfit(const Patch& patch, const Lines& lines, const Tail& tail, double level) {
  double chi2 = 0;
  int samples = 0;
  lines([&](const RimLine& line) {
    for_each_sample(patch, line, level, [&](double t, double signal) {
      const double model = tail.signal(level, t);
      chi2 += square(signal - model) / patch.noise().variance(model);
      ++samples;
    });
  });
  return samples > 0 ? chi2 / samples : 0;
}

/// Share of a lamp's area that is not clipped, away from its edges.
inline double unclipped_share(const Patch& patch, const Component& component) {
  constexpr int away_px = 3;
  const double clipped = clipped_share * patch.full_scale_signal();
  const double level = rim_level * patch.full_scale_signal();
  int inside = 0, unclipped = 0;
  for (int y = component.y0 + away_px; y <= component.y1 - away_px; ++y)
    for (int x = component.x0 + away_px; x <= component.x1 - away_px; ++x) {
      if (!(*patch.at(x - away_px, y) > level && *patch.at(x + away_px, y) > level &&
            *patch.at(x, y - away_px) > level && *patch.at(x, y + away_px) > level))
        continue;
      ++inside;
      unclipped += *patch.at(x, y) < clipped;
    }
  return inside > 0 ? static_cast<double>(unclipped) / inside : 0;
}

/// Adds the error of the points of a rim of which a part is hardly clipped: there the light inside
/// the lamp is taken for that of the tail. The covariance of the centre grows in proportion.
inline void add_unclipped_part(const Patch& patch, const Component& component,
                               std::vector<RimPoint>& points, Eigen::Matrix2d& centre_px2) {
  constexpr double min_share = 0.02, error_px = 0.05;  // found on rendered panels
  if (points.empty() || unclipped_share(patch, component) < min_share) return;
  double before = 0, after = 0;
  for (RimPoint& point : points) {
    before += square(point.sigma_px);
    point.sigma_px = std::hypot(point.sigma_px, error_px);
    after += square(point.sigma_px);
  }
  centre_px2 *= after / before;
}

/// Adds the errors of the rim's position: of a tail with another shape (`misfit`: tail_misfit()),
/// which lines of one side sample at the same places, and of the shift of a halo by the gradient of
/// the light, which is not known well.
inline void add_saturated_shift(double misfit, bool halo, const Eigen::Matrix2d& light_response_px2,
                                RimErrorCovariance& rim_px2, Eigen::Matrix2d& centre_px2) {
  constexpr double tail_px = 0.015;  // found where rendered tails end abruptly, at misfits above 10
  constexpr double gradient = 1e-3;  // a third of that of cos^4 at 18 degrees with f = 400 px
  const double doubt = std::clamp((misfit - 1.5) / 10, 0.0, 1.0);
  double variance = square(tail_px) * doubt;
  if (halo) variance += square(gradient) * light_response_px2.squaredNorm() / 2;
  rim_px2.diagonal().tail<4>().array() += variance;  // the growth is unknown in any case
  centre_px2.diagonal().array() += variance;
}

}  // namespace occ::internal::detect
