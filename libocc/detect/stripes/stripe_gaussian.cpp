// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/detect/internal/stripe_shape.hpp"

namespace occ::internal::detect {
namespace {

/// Region of the fit.
struct Disc {
  Eigen::Vector2d centre;
  double radius;
};

/// Logarithm of a window's signal; minus infinity for pixels that are not used.
LineWindow log_window(LineWindow window, const GaussianOptions& options) {
  const auto floor = static_cast<float>(options.floor), top = static_cast<float>(options.clipped);
  for (float& value : window.signal)
    value =
        value > floor && value < top ? std::log(value) : -std::numeric_limits<float>::infinity();
  return window;
}

/// Centroid of the log signal above the floor, and 2.6 times its standard deviation as radius.
Disc around(const LineWindow& log, double log_floor) {
  double sum = 0, squares = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  for (int line = log.box.line0; line <= log.box.line1; ++line) {
    const float* values = log.line(line);
    for (int i = 0; i < log.samples; ++i) {
      if (!(values[i] > log_floor)) continue;
      const double w = values[i] - log_floor;
      const Eigen::Vector2d at(line, log.pos(i));
      sum += w;
      first += w * at;
      squares += w * at.squaredNorm();
    }
  }
  if (!(sum > 0)) return {Eigen::Vector2d::Zero(), 0};
  const Eigen::Vector2d centre = first / sum;
  return {centre, 2.6 * std::sqrt(std::max(0.0, squares / sum - centre.squaredNorm()) / 2)};
}

using Vector10 = Eigen::Matrix<double, 10, 1>;
using Matrix10 = Eigen::Matrix<double, 10, 10>;

/// Normal equations of log = x0 + x1 u + x2 v + x3 u^2 + x4 u v + x5 v^2 + two harmonics (x6..x9).
struct Normals {
  Matrix10 information = Matrix10::Zero();
  Vector10 right = Vector10::Zero();
  double squares = 0, count = 0;

  /// Adds the sums of a line: v[k] = sum of v^k, t[k] = sum of log v^k, tt = sum of log^2. Along a
  /// line only 1, v and v^2 vary.
  void add_line(double u, double angle, const double (&v)[5], const double (&t)[3], double tt) {
    Eigen::Matrix<double, 10, 3> a = Eigen::Matrix<double, 10, 3>::Zero();
    const double c = std::cos(angle), s = std::sin(angle);
    a.col(0) << 1, u, 0, u * u, 0, 0, c, s, c * c - s * s, 2 * s * c;
    a(2, 1) = 1;
    a(4, 1) = u;
    a(5, 2) = 1;
    Eigen::Matrix3d moments;
    moments << v[0], v[1], v[2], v[1], v[2], v[3], v[2], v[3], v[4];
    information += a * moments * a.transpose();
    right += a * Eigen::Vector3d(t[0], t[1], t[2]);
    squares += tt;
    count += v[0];
  }
};

/// Sums over the pixels inside the disc and above the floor; u and v are relative to the disc.
Normals normals(const LineWindow& log, const Disc& disc, const Blink& blink, double log_floor) {
  Normals out;
  for (int line = log.box.line0; line <= log.box.line1; ++line) {
    const double u = (line - disc.centre[0]) / disc.radius;
    if (u * u >= 1) continue;
    const double half = disc.radius * std::sqrt(1 - u * u);
    const int end = log.sample_from(disc.centre[1] + half);
    const float* values = log.line(line);
    double v[5] = {}, t[3] = {}, tt = 0;
    for (int i = log.sample_from(disc.centre[1] - half); i < end; ++i) {
      const double value = values[i];
      if (!(value > log_floor)) continue;
      const double x = (log.pos(i) - disc.centre[1]) / disc.radius, xx = x * x;
      v[0] += 1;
      v[1] += x;
      v[2] += xx;
      v[3] += xx * x;
      v[4] += xx * xx;
      t[0] += value;
      t[1] += value * x;
      t[2] += value * xx;
      tt += value * value;
    }
    if (v[0] > 0) out.add_line(u, 2 * pi * blink.phase(line), v, t, tt);
  }
  return out;
}

struct QuadraticFit {
  Eigen::Vector2d centre;
  Eigen::Matrix2d curvature;  ///< Hessian of -log(signal); must be positive definite
  Eigen::Matrix2d covariance;
  double above_floor = 0;  ///< log(peak / floor)
};

std::optional<QuadraticFit> fit_quadratic(const LineWindow& log, const Disc& disc,
                                          const Blink& blink, double log_floor) {
  Normals sums = normals(log, disc, blink, log_floor);
  if (sums.count < 40) return std::nullopt;
  // Lit lines alone may not determine the harmonics: a weak prior keeps them near zero.
  for (int k = 6; k < 10; ++k) sums.information(k, k) += 1e-3 * sums.count;
  const Vector10 x =
      core::solve_ldlt<Eigen::MatrixXd, Eigen::VectorXd>(sums.information, sums.right);

  QuadraticFit fit;
  Eigen::Matrix2d h;
  h << -2 * x[3], -x[4], -x[4], -2 * x[5];
  if (!(h.trace() > 0 && h.determinant() > 1e-3 * h.trace() * h.trace())) return std::nullopt;
  const Eigen::Matrix2d h_inverse = h.inverse();
  const Eigen::Vector2d offset = h_inverse * x.segment<2>(1);
  fit.centre = disc.centre + disc.radius * offset;
  fit.curvature = h / (disc.radius * disc.radius);
  fit.above_floor = x[0] + 0.5 * offset.dot(h * offset) - log_floor;
  const double variance = std::max(0.0, sums.squares - sums.right.dot(x)) / sums.count;
  // The misfit of the model is correlated between pixels: each patch of 5 x 5 counts as one.
  const double patch = std::max(1.0, 25.0 / log.stride);
  const Eigen::Matrix2d of_slope =
      patch * variance * core::inverse<Eigen::MatrixXd>(sums.information).block<2, 2>(1, 1);
  fit.covariance = disc.radius * disc.radius * h_inverse * of_slope * h_inverse;
  return fit;
}

}  // namespace

std::optional<StripedShape> fit_gaussian(const LineWindow& window, const GaussianOptions& options) {
  const LineWindow log = log_window(window, options);
  const double log_floor = std::log(options.floor);
  Disc disc = around(log, log_floor);
  if (!(disc.radius > 2)) return std::nullopt;
  std::optional<QuadraticFit> fit;
  for (int iteration = 0; iteration < 4; ++iteration) {
    fit = fit_quadratic(log, disc, *options.blink, log_floor);
    // Diverged: not a Gaussian profile.
    if (!fit || (fit->centre - disc.centre).norm() > disc.radius) return std::nullopt;
    disc.centre = fit->centre;
  }
  const double range = std::max(0.7, fit->above_floor);
  // An ellipse far larger than the region of the fit is extrapolation.
  const double min_curvature = core::symmetric_eigenvalues(fit->curvature)[0];
  if (!(std::sqrt(2 * range / min_curvature) < 3 * disc.radius)) return std::nullopt;
  StripedShape lamp;
  lamp.centre = fit->centre;
  lamp.covariance = fit->covariance;
  lamp.log_range = range;
  lamp.shape = core::Cholesky<Eigen::Matrix2d>(fit->curvature / (2 * range)).lower().transpose();
  // For an asymmetric profile the brighter half (by its log) has a different centre.
  if (const auto inner =
          fit_quadratic(log, disc, *options.blink, log_floor + 0.5 * fit->above_floor))
    lamp.covariance +=
        (inner->centre - fit->centre).squaredNorm() / 2 * Eigen::Matrix2d::Identity();
  return lamp;
}

}  // namespace occ::internal::detect
