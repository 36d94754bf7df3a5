// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/stripe_centre.hpp"

namespace occ::internal::detect {
namespace {

std::vector<Eigen::Vector2d> ends_of(const std::vector<Chord>& chords) {
  std::vector<Eigen::Vector2d> ends;
  for (const Chord& chord : chords) {
    ends.emplace_back(chord.line, chord.pos0);
    ends.emplace_back(chord.line, chord.pos1);
  }
  return ends;
}

constexpr double model_sigma_px = 0.03;  // the ends' own bias: exposure, blur, pixel grid

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

/// Ellipse |M (p - c)| = r with M = [e^a, b; b, e^-a]; unknowns c, r, a, b.
struct RimEllipse {
  Vector5 x = Vector5::Zero();
  Matrix5 information = Matrix5::Zero();  ///< of residuals of unit variance
  double rms = 0;                         ///< robust, along the normal
  double correlation = 0;                 ///< of residuals of neighbouring lines, same end

  Eigen::Matrix2d m() const {
    Eigen::Matrix2d out;
    out << std::exp(x[3]), x[4], x[4], std::exp(-x[3]);
    return out;
  }
};

/// Distance of p from the ellipse along the normal (first order), its Jacobian, the normal.
double ellipse_residual(const RimEllipse& fit, const Eigen::Vector2d& p, Vector5* jacobian,
                        Eigen::Vector2d* normal) {
  const Eigen::Vector2d d = p - fit.x.head<2>();
  const Eigen::Matrix2d m = fit.m();
  const Eigen::Vector2d q = m * d;
  const double length = std::max(1e-9, q.norm());
  const Eigen::Vector2d gradient = m * q / length;
  const double scale = gradient.norm();
  if (normal) *normal = gradient / scale;
  if (jacobian) {
    const double da = (q[0] * m(0, 0) * d[0] - q[1] * m(1, 1) * d[1]) / length;
    const double db = (q[0] * d[1] + q[1] * d[0]) / length;
    *jacobian << -gradient, -1, da, db;
    *jacobian /= scale;
  }
  return (length - fit.x[2]) / scale;
}

/// Robust Gauss-Newton from a start; `ends` as ends_of() orders them.
RimEllipse fit_rim(const std::vector<Eigen::Vector2d>& ends, RimEllipse fit) {
  constexpr double shape_sigma = 0.35;  // prior: lamps are seldom seen at more than 60 degrees
  fit.rms = std::max(1.0, 0.1 * fit.x[2]);
  std::vector<double> residuals(ends.size());
  for (int iteration = 0; iteration < 20; ++iteration) {
    Matrix5 information = Matrix5::Zero();
    Vector5 right = Vector5::Zero();
    std::vector<double> sizes;
    for (std::size_t i = 0; i < ends.size(); ++i) {
      Vector5 j;
      const double r = residuals[i] = ellipse_residual(fit, ends[i], &j, nullptr);
      const double u = r / (3 * fit.rms);
      const double weight = 1 / (1 + u * u);
      information += weight * j * j.transpose();
      right -= weight * r * j;
      sizes.push_back(std::abs(r));
    }
    fit.information = information;
    const double prior = fit.rms * fit.rms / (shape_sigma * shape_sigma);
    for (int k = 3; k < 5; ++k) {
      fit.information(k, k) += prior;
      right[k] -= prior * fit.x[k];
    }
    const Vector5 step = fit.information.ldlt().solve(right);
    fit.x += step;
    fit.x.tail<2>() = fit.x.tail<2>().cwiseMax(-1.2).cwiseMin(1.2);
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    fit.rms = std::max(0.02, 1.4826 * *middle);
    if (step.head<3>().norm() < 1e-6 * std::abs(fit.x[2])) break;
  }
  double product = 0, square = 0;
  for (std::size_t i = 0; i + 2 < ends.size(); ++i) {
    const double bound = 3 * fit.rms;
    const double a = std::clamp(residuals[i], -bound, bound);
    const double b = std::clamp(residuals[i + 2], -bound, bound);
    product += a * b;
    square += a * a;
  }
  fit.correlation = square > 0 ? std::clamp(product / square, 0.0, 0.8) : 0;
  return fit;
}

/// Start: middle and size of the chords' box.
RimEllipse first_guess(const std::vector<Chord>& chords) {
  double pos = 0, longest = 0;
  for (const Chord& chord : chords) {
    pos += (chord.pos0 + chord.pos1) / 2 / static_cast<double>(chords.size());
    longest = std::max(longest, chord.pos1 - chord.pos0);
  }
  RimEllipse fit;
  fit.x << (chords.front().line + chords.back().line) / 2.0, pos, longest / 2, 0, 0;
  return fit;
}

/// Whether the ellipse begins and ends where the lit lines do, but for a gap that may be there. (A
/// rectangle's sides fit a long ellipse well.)
bool spans(const RimEllipse& fit, const std::vector<Chord>& chords) {
  const Eigen::Matrix2d m = fit.m() / fit.x[2];
  const double half = std::sqrt((m.transpose() * m).inverse()(0, 0));
  const double before = chords.front().line - (fit.x[0] - half);
  const double behind = fit.x[0] + half - chords.back().line;
  const double slack = 3 + 0.03 * half;
  const double most = widest_gap(chords) + slack;
  return before > -slack && before < most && behind > -slack && behind < most;
}

}  // namespace

std::optional<StripedShape> fit_disc(const SharpChords& chords) {
  const std::vector<Eigen::Vector2d> ends = ends_of(chords.half);
  const RimEllipse fit = fit_rim(ends, first_guess(chords.half));
  const double radius = fit.x[2];
  if (!(radius > 2) || !(fit.m().determinant() > 0.1) || !(fit.rms < 0.3 + 0.015 * radius) ||
      !spans(fit, chords.half))
    return std::nullopt;

  StripedShape disc;
  disc.kind = StripedShape::Kind::disc;
  disc.centre = fit.x.head<2>();
  disc.shape = fit.m() / radius;
  const double inflation = (1 + fit.correlation) / (1 - fit.correlation);
  disc.rim_sigma_px = fit.rms * std::sqrt(inflation);
  disc.rim_growth_variance_px2 = disc.rim_shift_variance_px2 = model_sigma_px * model_sigma_px;
  // What the choice of the contour's level changes is a systematic part of the error: half of the
  // shift; of the growth a tenth, as half of the plateau is the right level but for its unevenness.
  if (chords.low.size() >= 5 && chords.high.size() >= 5) {
    const Vector5 change =
        fit_rim(ends_of(chords.high), fit).x - fit_rim(ends_of(chords.low), fit).x;
    disc.rim_shift_variance_px2 += change.head<2>().squaredNorm() / 4;
    disc.rim_growth_variance_px2 += change[2] * change[2] / 100;
  }
  disc.covariance = disc.rim_sigma_px * disc.rim_sigma_px *
                        Matrix5(fit.information.inverse()).topLeftCorner<2, 2>() +
                    disc.rim_shift_variance_px2 * Eigen::Matrix2d::Identity();
  for (const Eigen::Vector2d& end : ends) {
    Eigen::Vector2d normal;
    const double r = ellipse_residual(fit, end, nullptr, &normal);
    if (std::abs(r) < 4 * fit.rms + 0.5) disc.rim.push_back({end, normal});
  }
  if (5 * disc.rim.size() < 4 * ends.size()) return std::nullopt;
  return disc;
}

}  // namespace occ::internal::detect
