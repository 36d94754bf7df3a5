// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/detect/outline.hpp"
#include "libocc/detect/rim.hpp"
#include "libocc/detect/rim_line.hpp"

namespace occ::detecting {
namespace {

// Only the tail of the edge is left below full scale. It is described by what the blob itself
// shows, not by a PSF: the logarithm of the signal, all around the rim, as a parabola in the
// distance from the rim.
constexpr double brightest_used = 0.97, dimmest_used = 0.03;  // of full scale
constexpr double inside_px = 1.5, outside_px = 4;             // window about the rim
constexpr double rim_level = 0.5;                             // of full scale
constexpr int most_passes = 8;
constexpr double settled_px = 0.003;
constexpr double least_minor_px = 2;
constexpr double usual_gradient = 0.005;  // of brightness, per pixel: cos^4 and Lambert, wide lens

double square(double v) { return v * v; }

/// ln(signal / level at the rim) = offset - slope t - bend t^2, t pixels outside the rim.
struct Tail {
  double offset = 0, slope = 1.5, bend = 0.3;

  double signal(double level, double t) const {
    return level * std::exp(offset - t * (slope + bend * t));
  }
  double decay(double t) const { return slope + 2 * bend * t; }

  /// Where the signal is that of the rim's level; the offset is small once the ellipse is right.
  double rim() const { return std::clamp(offset / decay(0.5 * offset / slope), -1.0, 1.0); }
};

struct Sample {
  double t, signal;
};

/// Samples of a line that are neither clipped nor lost in the background.
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
    if (!(signal < brightest_used * full && signal > dimmest_used * full)) continue;
    const double d = outward * (along - line.edge);
    f(d * cosine + 0.5 * curvature * square(d) * (1 - square(cosine)), signal);
  }
}

Tail fit_tail(const Patch& patch, const Conic& conic, double level) {
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
  const Eigen::Vector3d s = normal.ldlt().solve(right);
  Tail tail;
  tail.offset = s[0];
  tail.slope = s[1];
  tail.bend = s[2];
  return tail;
}

/// One rim point for each line: the shift of the tail that fits its samples best.
std::vector<RimPoint> fit_points(const Patch& patch, const Conic& conic, const Tail& tail,
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

/// How growth varies around the rim: by (u, v) . change [px], with (u, v) the place on the rim in
/// units of the disc's size.
struct GrowthVariation {
  Eigen::Vector2d change = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

Eigen::Vector2d place_on(const Conic& conic, const Eigen::Vector2d& px) {
  return (px - conic.centre) * std::pow(conic.shape.determinant(), 0.25);
}

/// Growth slides the rim along the tail, out to where the logarithm falls more steeply: a slope
/// that varies around the rim by d means growth that varies by d / (2 bend). Least squares within
/// the lines: where each line's tail lies is left free. Scatter beyond the noise widens the
/// covariance.
std::optional<GrowthVariation> growth_variation(const Patch& patch, const Conic& conic,
                                                double level) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  double squares = 0;
  int dof = -4;
  for_each_rim_line(conic, [&](const RimLine& line) {
    const Eigen::Vector2d at = place_on(conic, line.point(line.edge));
    Eigen::Vector4d row_sum = Eigen::Vector4d::Zero();
    double weight_sum = 0, sum = 0;
    for_each_sample(patch, line, [&](double t, double signal) {
      const Eigen::Vector4d row(-t, -t * at.x(), -t * at.y(), -t * t);
      const double weight = square(signal) / patch.noise().variance(signal);
      const double value = std::log(signal / level);
      normal += weight * row * row.transpose();
      right += weight * value * row;
      squares += weight * value * value;
      row_sum += weight * row;
      sum += weight * value;
      weight_sum += weight;
      ++dof;
    });
    if (!(weight_sum > 0)) return;
    normal -= row_sum * row_sum.transpose() / weight_sum;
    right -= row_sum * sum / weight_sum;
    squares -= sum * sum / weight_sum;
    --dof;
  });
  if (dof < 8) return std::nullopt;
  const Eigen::Matrix4d inverse = normal.inverse();
  const Eigen::Vector4d fit = inverse * right;
  const double excess = std::max(1.0, (squares - fit.dot(right)) / dof);
  const double bend = fit[3];
  if (!(bend > 5 * std::sqrt(excess * inverse(3, 3)))) return std::nullopt;
  return GrowthVariation{fit.segment<2>(1) / (2 * bend),
                         excess * inverse.block<2, 2>(1, 1) / square(2 * bend)};
}

/// A lamp that is brighter on one side grows more there, which would move its centre. That part is
/// taken back as far as it can be told from none, lamps having a gradient of about usual_gradient;
/// what is left adds to the covariance.
void even_out_growth(const Patch& patch, double level, double slope, Rim& rim) {
  const Conic& conic = rim.fit.conic;
  const double size = std::pow(conic.shape.determinant(), -0.25);
  GrowthVariation variation;
  variation.covariance = square(usual_gradient * size / slope) * Eigen::Matrix2d::Identity();
  if (const auto seen = growth_variation(patch, conic, level)) {
    const Eigen::Matrix2d sum = variation.covariance + seen->covariance;
    const Eigen::Matrix2d gain = variation.covariance * sum.inverse();
    variation = {gain * seen->change, gain * seen->covariance};
  }
  std::vector<Eigen::Vector2d> moves;
  for (const RimPoint& point : rim.points) moves.push_back(-place_on(conic, point.px));
  for (std::size_t i = 0; i < moves.size(); ++i)
    rim.points[i].px += moves[i].dot(variation.change) * rim.points[i].normal;
  const Eigen::Matrix2d response = centre_response(rim.points, conic, moves);
  add_common_shift(response * variation.covariance * response.transpose(), rim);
  if (const std::optional<EllipseFit> again = fit_ellipse(rim.points, conic))
    rim.fit.conic = again->conic;
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
  Conic conic = outline->conic;
  for (int pass = 0; pass < most_passes; ++pass) {
    if (conic.ellipse().semi_minor_px < least_minor_px) return std::nullopt;
    const Tail tail = fit_tail(patch, conic, level);
    if (!(tail.slope > 0) || !std::isfinite(tail.bend)) return std::nullopt;
    rim.points = fit_points(patch, conic, tail, level);
    const std::optional<EllipseFit> fit = fit_ellipse(rim.points, conic);
    if (!fit) return std::nullopt;
    const bool settled =
        (fit->conic.centre - conic.centre).norm() < settled_px && std::abs(tail.rim()) < settled_px;
    conic = fit->conic;
    rim.fit = *fit;
    if (settled) {
      widen_sigmas(rim);
      even_out_growth(patch, level, tail.slope, rim);
      return rim;
    }
  }
  return std::nullopt;
}

}  // namespace occ::detecting
