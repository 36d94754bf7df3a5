// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/subpixel.hpp"

namespace occ::internal::detect {
namespace {

constexpr double reach = 3;               // half width of the window [sigma of the spot, x or y]
constexpr double model_parameters = 7.5;  // effective number; flux, centre, second moments are 6,
                                          // and they act in the core of the spot
constexpr double min_share = 0.25;        // lower bound of the remaining degrees of freedom
constexpr int moment_steps = 6;
constexpr double spot_settled_px = 0.01;  // convergence limit; the shift steps improve the rest
constexpr int shift_steps = 2;
constexpr double linear_px = 0.03;       // after a smaller shift one step suffices
constexpr double min_seen_px2 = 0.36;    // min variance that pixels sample with an error of 1 %
constexpr double widest_weight_px2 = 4;  // max variance of the weight

bool positive(const Eigen::Matrix2d& m) { return m(0, 0) > 0 && m.determinant() > 0; }

struct Window {
  int x0, y0, x1, y1;  ///< both ends included
};

/// Pixels of the patch within reach of a Gaussian.
Window window_of(const Patch& patch, const Spot& spot) {
  const double rx = reach * std::sqrt(spot.second_moments_px2(0, 0));
  const double ry = reach * std::sqrt(spot.second_moments_px2(1, 1));
  const auto low = [](double v, int bound) {
    return std::max(bound, static_cast<int>(std::ceil(v)));
  };
  const auto high = [](double v, int bound) {
    return std::min(bound, static_cast<int>(std::floor(v)));
  };
  return {low(spot.centre_px.x() - rx, patch.x0()), low(spot.centre_px.y() - ry, patch.y0()),
          high(spot.centre_px.x() + rx, patch.x0() + patch.width() - 1),
          high(spot.centre_px.y() + ry, patch.y0() + patch.height() - 1)};
}

/// Calls pixel(signal, gaussian, dx) for the pixels of the window where the Gaussian is not
/// negligible, row by row, and row_end(dy) after each row. The Gaussian is 1 at the centre. Along a
/// row it is computed from its neighbour by two multiplications; the first value never underflows.
template <typename Pixel, typename RowEnd>
void for_each(const Patch& patch, const Spot& spot, Pixel&& pixel, RowEnd&& row_end) {
  constexpr double row_reach = 4.5;  // [sigma along a row]; beyond, the Gaussian is below 4e-5
  const Window window = window_of(patch, spot);
  const Eigen::Matrix2d inverse = spot.second_moments_px2.inverse();
  const double a = inverse(0, 0), b = inverse(0, 1);
  const double half_width = row_reach / std::sqrt(a);
  const double step_of_ratio = std::exp(-a);
  for (int y = window.y0; y <= window.y1; ++y) {
    const double dy = y - spot.centre_px.y();
    const double middle = spot.centre_px.x() - b / a * dy;  // maximum of the Gaussian in this row
    const int x0 = std::max(window.x0, static_cast<int>(std::ceil(middle - half_width)));
    const int x1 = std::min(window.x1, static_cast<int>(std::floor(middle + half_width)));
    const double out = x0 - middle;
    double gaussian = std::exp(-0.5 * (a * out * out + dy * dy / spot.second_moments_px2(1, 1)));
    double ratio = std::exp(-a * (out + 0.5));
    double dx = x0 - spot.centre_px.x();
    const float* signal = patch.at(x0, y);
    for (int x = x0; x <= x1; ++x, dx += 1) {
      pixel(static_cast<double>(*signal++), gaussian, dx);
      gaussian *= ratio;
      ratio *= step_of_ratio;
    }
    row_end(dy);
  }
}

/// Moments about the centre, summed row by row.
struct RowMoments {
  double row = 0, row_x = 0, row_xx = 0;
  Moments all;

  void add(double value, double dx) {
    row += value;
    row_x += value * dx;
    row_xx += value * dx * dx;
  }

  void end_row(double dy) {
    all += {row, row_x, row * dy, row_xx, row_x * dy, row * dy * dy};
    row = row_x = row_xx = 0;
  }
};

/// Height of the Gaussian above the background, and the noise of its pixels.
struct Light {
  double peak = 0;
  Noise noise;
};

/// Estimates height and noise. Without a sensor the shot noise follows from the scatter about the
/// model, which includes the misfit of the model and is therefore an upper bound.
Light light_of(const Patch& patch, const Spot& spot) {
  double g = 0, gg = 0, ggg = 0, gs = 0, ggs = 0, gss = 0;  // sums; s: signal
  for_each(
      patch, spot,
      [&](double signal, double gaussian, double) {
        const double g2 = gaussian * gaussian, seen = gaussian * signal;
        g += gaussian;
        gg += g2;
        ggg += g2 * gaussian;
        gs += seen;
        ggs += gaussian * seen;
        gss += signal * seen;
      },
      [](double) {});
  Light light{gs / gg, patch.noise()};
  if (light.noise.known) return light;
  const double p = light.peak;
  const double scatter = gss - 2 * p * ggs + p * p * ggg;  // sum of g (s - p g)^2
  // The fitted parameters have removed their share of the scatter of so many pixels.
  const double pixels = g * g / gg;
  const double share = std::max(min_share, 1 - model_parameters / pixels);
  light.noise.per_dn = std::max(0.0, (scatter / share - g * light.noise.floor) / (p * gg));
  return light;
}

/// Widens a covariance to at least this variance in every direction.
void widen(Eigen::Matrix2d& covariance, double variance) {
  covariance.diagonal() = covariance.diagonal().cwiseMax(variance + std::abs(covariance(0, 1)));
}

/// Variance of the weight function for light of this variance: the same, which is optimal for
/// noise, or larger where the product of both would be too narrow for the pixels.
double weight_variance(double light) {
  if (light >= 2 * min_seen_px2) return light;
  const double inverse = 1 / min_seen_px2 - 1 / light;
  return inverse > 1 / widest_weight_px2 ? 1 / inverse : widest_weight_px2;
}

/// One step of adaptive moments (Bernstein & Jarvis, AJ 123, 2002, section 3). Under a Gaussian
/// weight of covariance M, Gaussian light of covariance C has covariance P = (C^-1 + M^-1)^-1, and
/// its mean is P C^-1 times its distance. Returns the shift of the centre.
std::optional<double> moment_step(const Patch& patch, double min_variance_px2, Spot& spot) {
  RowMoments seen_light;
  Spot window = spot;
  widen(window.second_moments_px2, weight_variance(spot.second_moments_px2.diagonal().minCoeff()));
  for_each(
      patch, window,
      [&](double signal, double weight, double dx) { seen_light.add(signal * weight, dx); },
      [&](double dy) { seen_light.end_row(dy); });
  if (!(seen_light.all.sum > 0)) return std::nullopt;
  const Eigen::Vector2d mean = seen_light.all.mean();
  const Eigen::Matrix2d seen = seen_light.all.variance();
  if (!positive(seen)) return std::nullopt;
  const Eigen::Matrix2d& weight = window.second_moments_px2;
  const Eigen::Matrix2d inverse = seen.inverse() - weight.inverse();
  // For light much wider than the weight the difference is ill-conditioned: enlarge and iterate.
  const bool wide = !positive(inverse - 0.25 * weight.inverse());
  const Eigen::Matrix2d light = wide ? Eigen::Matrix2d(3 * seen) : inverse.inverse();
  const Eigen::Vector2d shift = light * seen.inverse() * mean;
  spot.centre_px += shift;
  spot.second_moments_px2 = light;
  widen(spot.second_moments_px2, min_variance_px2);
  return shift.norm();
}

/// One weighted least-squares step of the shift; the inverse normal matrix is the covariance.
/// Weights are computed from the model, so that noise does not bias them.
std::optional<double> shift_step(const Patch& patch, const Light& light, Spot& spot) {
  RowMoments residual, curvature;
  for_each(
      patch, spot,
      [&](double signal, double gaussian, double dx) {
        const double model = light.peak * gaussian;
        const double weight = model / light.noise.variance(model);
        residual.add(weight * (signal - model), dx);
        curvature.add(weight * model, dx);
      },
      [&](double dy) {
        residual.end_row(dy);
        curvature.end_row(dy);
      });
  const Eigen::Vector2d right(residual.all.x, residual.all.y);
  Eigen::Matrix2d normal;
  normal << curvature.all.xx, curvature.all.xy, curvature.all.xy, curvature.all.yy;
  if (!positive(normal)) return std::nullopt;
  // d model / d centre = model M^-1 d; M cancels on one side of the step.
  const Eigen::Matrix2d inverse = normal.inverse();
  const Eigen::Vector2d shift = spot.second_moments_px2 * inverse * right;
  spot.centre_px += shift;
  spot.covariance_px2 = spot.second_moments_px2 * inverse * spot.second_moments_px2;
  // Light times (1 + g d) shifts the centre by its second moments under the weight, times g.
  Eigen::Matrix2d light_moments;
  light_moments << residual.all.xx, residual.all.xy, residual.all.xy, residual.all.yy;
  light_moments += normal;
  spot.gradient_response_px2 = spot.second_moments_px2 * inverse * light_moments;
  return shift.norm();
}

}  // namespace

std::optional<Spot> measure_spot(const Patch& patch, const Eigen::Vector2d& centre_px,
                                 const Eigen::Matrix2d& second_moments_px2,
                                 double min_variance_px2) {
  Spot spot;
  spot.centre_px = centre_px;
  spot.second_moments_px2 = second_moments_px2;
  constexpr double max_variance = Patch::margin_px * Patch::margin_px;
  // False for NaN.
  const auto found = [&] {
    return (spot.centre_px - centre_px).squaredNorm() <= max_variance &&
           positive(spot.second_moments_px2) && spot.second_moments_px2.trace() <= 2 * max_variance;
  };
  if (!found()) return std::nullopt;
  for (int i = 0; i < moment_steps; ++i) {
    const std::optional<double> moved = moment_step(patch, min_variance_px2, spot);
    if (!moved || !found()) return std::nullopt;
    if (*moved < spot_settled_px) break;
  }
  const Light light = light_of(patch, spot);
  if (!(light.peak > 0)) return std::nullopt;
  for (int i = 0; i < shift_steps; ++i) {
    const std::optional<double> moved = shift_step(patch, light, spot);
    if (!moved || !found()) return std::nullopt;
    if (*moved < linear_px) break;
  }
  return spot;
}

}  // namespace occ::internal::detect
