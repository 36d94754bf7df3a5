// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/spot.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/component.hpp"

namespace occ::internal::detect {
namespace {

constexpr double reach = 3;               // of the window, in sigmas of the spot along x or y
constexpr double model_parameters = 7.5;  // flux, centre, second moments: 6, which sit in the core
constexpr double min_share = 0.25;
constexpr int moment_steps = 6;
constexpr double settled_px = 0.01;  // the shift steps that follow do the rest
constexpr int shift_steps = 2;
constexpr double linear_px = 0.03;     // over so little one shift step is all that it takes
constexpr double min_seen_px2 = 0.36;  // variance of what pixels still sample to a per cent
constexpr double widest_weight_px2 = 4;

bool positive(const Eigen::Matrix2d& m) { return m(0, 0) > 0 && m.determinant() > 0; }

struct Window {
  int x0, y0, x1, y1;  ///< both ends included
};

/// The pixels within reach of a Gaussian, those that the patch has.
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

/// Calls pixel(signal, gaussian, dx) for the window's pixels that the Gaussian reaches, row by row,
/// and row_end(dy) after each row; the Gaussian is 1 at the centre. Along a row it follows from its
/// neighbour by two multiplications, from a start that is never so far out that it vanishes.
template <typename Pixel, typename RowEnd>
void for_each(const Patch& patch, const Spot& spot, Pixel&& pixel, RowEnd&& row_end) {
  constexpr double row_reach = 4.5;  // sigmas along a row: beyond, the Gaussian is below 4e-5
  const Window window = window_of(patch, spot);
  const Eigen::Matrix2d inverse = spot.second_moments_px2.inverse();
  const double a = inverse(0, 0), b = inverse(0, 1);
  const double half_width = row_reach / std::sqrt(a);
  const double step_of_ratio = std::exp(-a);
  for (int y = window.y0; y <= window.y1; ++y) {
    const double dy = y - spot.centre_px.y();
    const double middle = spot.centre_px.x() - b / a * dy;  // where the row's Gaussian is highest
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

/// Moments about the centre, added up row by row.
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

/// A Gaussian's height over the background, and the noise of what it covers.
struct Light {
  double peak = 0;
  Noise noise;
};

/// Shot noise that no sensor tells is read from the scatter about the model, to which the model's
/// own misfit adds: it errs to the safe side.
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
  // The model has been fitted to so many pixels: its parameters have taken their share of scatter.
  const double pixels = g * g / gg;
  const double share = std::max(min_share, 1 - model_parameters / pixels);
  light.noise.per_dn = std::max(0.0, (scatter / share - g * light.noise.floor) / (p * gg));
  return light;
}

/// Widens a covariance to at least this variance in every direction.
void widen(Eigen::Matrix2d& covariance, double variance) {
  covariance.diagonal() = covariance.diagonal().cwiseMax(variance + std::abs(covariance(0, 1)));
}

/// Variance of the weight through which light of this variance is looked at: its own, which is
/// best against noise, or more where the product of both would fall between the pixels.
double weight_variance(double light) {
  if (light >= 2 * min_seen_px2) return light;
  const double inverse = 1 / min_seen_px2 - 1 / light;
  return inverse > 1 / widest_weight_px2 ? 1 / inverse : widest_weight_px2;
}

/// One step of adaptive moments (Bernstein & Jarvis, AJ 123, 2002, section 3): seen through a
/// Gaussian weight of covariance M, Gaussian light of covariance C has covariance
/// P = (C^-1 + M^-1)^-1, and its mean is P C^-1 times its distance. Returns how far the centre
/// moved.
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
  // Light much wider than the weight leaves nothing of that difference: then grow and look again.
  const bool wide = !positive(inverse - 0.25 * weight.inverse());
  const Eigen::Matrix2d light = wide ? Eigen::Matrix2d(3 * seen) : inverse.inverse();
  const Eigen::Vector2d shift = light * seen.inverse() * mean;
  spot.centre_px += shift;
  spot.second_moments_px2 = light;
  widen(spot.second_moments_px2, min_variance_px2);
  return shift.norm();
}

/// One weighted least-squares step of the shift; its inverse normal matrix is the covariance.
/// Weights come from the model, so that noise does not steer them.
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
  // d model / d centre = model M^-1 d; M cancels out of the step on one side.
  const Eigen::Matrix2d inverse = normal.inverse();
  const Eigen::Vector2d shift = spot.second_moments_px2 * inverse * right;
  spot.centre_px += shift;
  spot.covariance_px2 = spot.second_moments_px2 * inverse * spot.second_moments_px2;
  // Light times (1 + g d) pulls by the light's second moments under the weight.
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
  // Written so that what is not a number is lost.
  const auto found = [&] {
    return (spot.centre_px - centre_px).squaredNorm() <= max_variance &&
           positive(spot.second_moments_px2) && spot.second_moments_px2.trace() <= 2 * max_variance;
  };
  if (!found()) return std::nullopt;
  for (int i = 0; i < moment_steps; ++i) {
    const std::optional<double> moved = moment_step(patch, min_variance_px2, spot);
    if (!moved || !found()) return std::nullopt;
    if (*moved < settled_px) break;
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
