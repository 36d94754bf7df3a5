// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/spot.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace occ::detecting {
namespace {

constexpr double reach = 3;  // of the window, in sigmas of the spot along x or y
constexpr int moment_steps = 6;
constexpr double settled_px = 0.003;  // the shift steps that follow are linear over so little
constexpr int shift_steps = 2;
constexpr double least_variance_px2 = 0.11;  // a point under the pixel's box and a hint of blur

double square(double v) { return v * v; }

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

/// Calls f(signal, gaussian, dx, dy) for every pixel of the window; the Gaussian is 1 at the
/// centre. Along a row it follows from its neighbour by two multiplications.
template <typename F>
void for_each(const Patch& patch, const Spot& spot, F&& f) {
  const Window window = window_of(patch, spot);
  const Eigen::Matrix2d inverse = spot.second_moments_px2.inverse();
  const double a = inverse(0, 0), b = inverse(0, 1), c = inverse(1, 1);
  const double step_of_ratio = std::exp(-a);
  for (int y = window.y0; y <= window.y1; ++y) {
    const double dy = y - spot.centre_px.y();
    double dx = window.x0 - spot.centre_px.x();
    double gaussian = std::exp(-0.5 * (a * dx * dx + 2 * b * dx * dy + c * dy * dy));
    double ratio = std::exp(-(a * (dx + 0.5) + b * dy));
    const float* signal = patch.at(window.x0, y);
    for (int x = window.x0; x <= window.x1; ++x, dx += 1) {
      f(static_cast<double>(*signal++), gaussian, dx, dy);
      gaussian *= ratio;
      ratio *= step_of_ratio;
    }
  }
}

/// One step of adaptive moments (Bernstein & Jarvis, AJ 123, 2002, section 3): seen through a
/// Gaussian weight of covariance M, Gaussian light of covariance C has covariance
/// P = (C^-1 + M^-1)^-1, and its mean is P C^-1 times its distance. Returns how far the centre
/// moved.
std::optional<double> moment_step(const Patch& patch, Spot& spot) {
  double s = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  for_each(patch, spot, [&](double signal, double weight, double dx, double dy) {
    const double v = signal * weight;
    s += v;
    sx += v * dx;
    sy += v * dy;
    sxx += v * dx * dx;
    sxy += v * dx * dy;
    syy += v * dy * dy;
  });
  if (!(s > 0)) return std::nullopt;
  const Eigen::Vector2d mean(sx / s, sy / s);
  Eigen::Matrix2d seen;
  seen << sxx / s, sxy / s, sxy / s, syy / s;
  seen -= mean * mean.transpose();
  if (!positive(seen)) return std::nullopt;
  const Eigen::Matrix2d& weight = spot.second_moments_px2;
  const Eigen::Matrix2d inverse = seen.inverse() - weight.inverse();
  // Light much wider than the weight leaves nothing of that difference: then grow and look again.
  const bool wide = !positive(inverse - 0.25 * weight.inverse());
  const Eigen::Matrix2d light = wide ? Eigen::Matrix2d(3 * seen) : inverse.inverse();
  const Eigen::Vector2d shift = light * seen.inverse() * mean;
  spot.centre_px += shift;
  spot.second_moments_px2 = light;
  spot.second_moments_px2.diagonal() =
      light.diagonal().cwiseMax(least_variance_px2 + std::abs(light(0, 1)));
  return shift.norm();
}

/// The patch's noise; shot noise that no sensor tells is read from the scatter about the model, to
/// which the model's own misfit adds: it errs to the safe side.
Noise noise_of(const Patch& patch, const Spot& spot, double peak) {
  Noise noise = patch.noise();
  if (noise.known) return noise;
  double scatter = 0, expected = 0, light = 0;
  for_each(patch, spot, [&](double signal, double gaussian, double, double) {
    scatter += gaussian * square(signal - peak * gaussian);
    expected += gaussian * noise.floor;
    light += gaussian * peak * gaussian;
  });
  noise.per_dn = std::max(0.0, (scatter - expected) / light);
  return noise;
}

/// One weighted least-squares step of the shift, the model's flux fitted along; its inverse normal
/// matrix is the covariance. Weights come from the model, so that noise does not steer them.
bool shift_step(const Patch& patch, Spot& spot) {
  double gi = 0, gg = 0;
  for_each(patch, spot, [&](double signal, double gaussian, double, double) {
    gi += gaussian * signal;
    gg += gaussian * gaussian;
  });
  const double peak = gi / gg;
  if (!(peak > 0)) return false;
  const Noise noise = noise_of(patch, spot, peak);
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  for_each(patch, spot, [&](double signal, double gaussian, double dx, double dy) {
    const double model = peak * gaussian;
    const Eigen::Vector2d d(dx, dy);
    const double weight = model / noise.variance(model);
    right += weight * (signal - model) * d;
    normal += weight * model * d * d.transpose();
  });
  if (!positive(normal)) return false;
  // d model / d centre = model M^-1 d; M cancels out of the step on one side.
  const Eigen::Matrix2d inverse = normal.inverse();
  spot.centre_px += spot.second_moments_px2 * inverse * right;
  spot.covariance_px2 = spot.second_moments_px2 * inverse * spot.second_moments_px2;
  return true;
}

}  // namespace

std::optional<Spot> measure_spot(const Patch& patch, const Eigen::Vector2d& centre_px,
                                 const Eigen::Matrix2d& second_moments_px2) {
  Spot spot;
  spot.centre_px = centre_px;
  spot.second_moments_px2 = second_moments_px2;
  const double most_variance = square(Patch::margin_px);
  for (int i = 0; i < moment_steps; ++i) {
    const std::optional<double> moved = moment_step(patch, spot);
    const bool lost = !moved || (spot.centre_px - centre_px).squaredNorm() > most_variance ||
                      spot.second_moments_px2.trace() > 2 * most_variance;
    if (lost) return std::nullopt;
    if (*moved < settled_px) break;
  }
  for (int i = 0; i < shift_steps; ++i)
    if (!shift_step(patch, spot)) return std::nullopt;
  return spot;
}

}  // namespace occ::detecting
