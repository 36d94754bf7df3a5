// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/detect/internal/stripe_shape.hpp"

namespace occ::internal::detect {
namespace {

/// Finds the outermost crossings of `level` in a line; false when there are none inside the window.
bool crossings(const float* signal, int length, double level, double& first, double& last) {
  int a = 0, b = length - 1;
  while (a < length && !(signal[a] > level)) ++a;
  while (b > a && !(signal[b] > level)) --b;
  if (a == 0 || a >= length || b == length - 1 || b - a < 3) return false;
  first = a - (signal[a] - level) / (signal[a] - signal[a - 1]);
  last = b + (signal[b] - level) / (signal[b] - signal[b + 1]);
  return true;
}

/// Mean of the pixels of a line above half of its maximum.
double plateau(const float* signal, int length) {
  const float half = 0.5f * *std::max_element(signal, signal + length);
  double sum = 0;
  int count = 0;
  for (int i = 0; i < length; ++i) {
    if (!(signal[i] > half)) continue;
    sum += signal[i];
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

/// Chords of all well-lit lines of a part of a window (stride 1), in the order of the lines. Their
/// ends are at a fraction of each line's plateau. `peak`: signal of the brightest lines.
std::vector<Chord> lit_chords(const LineWindow& window, const LineBox& part, double peak,
                              double fraction) {
  std::vector<Chord> chords;
  for (int line = part.line0; line <= part.line1; ++line) {
    const float* signal = window.line(line) + (part.pos0 - window.box.pos0);
    const int length = part.length();
    const double top = plateau(signal, length);
    if (top < 0.55 * peak) continue;
    double a, b, inner_a, inner_b, outer_a, outer_b;
    if (!crossings(signal, length, fraction * top, a, b) ||
        !crossings(signal, length, 0.75 * top, inner_a, inner_b) ||
        !crossings(signal, length, 0.25 * top, outer_a, outer_b))
      continue;
    const double soft = (outer_b - outer_a - (inner_b - inner_a)) / 2 / ((b - a) / 2);
    chords.push_back({line, part.pos0 + a, part.pos0 + b, soft});
  }
  return chords;
}

double median_softness(const std::vector<Chord>& chords) {
  std::vector<double> values;
  for (const Chord& chord : chords) values.push_back(chord.softness);
  return median(std::move(values));
}

/// Largest number of lines between two successive chords.
int widest_gap(const std::vector<Chord>& chords) {
  int gap = 0;
  for (std::size_t i = 1; i < chords.size(); ++i)
    gap = std::max(gap, chords[i].line - chords[i - 1].line - 1);
  return gap;
}

/// Moments of the area between chords.
struct Area {
  double sum = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();

  void add(double line, double pos0, double pos1) {
    const double width = pos1 - pos0;
    const Eigen::Vector2d middle(line, 0.5 * (pos0 + pos1));
    sum += width;
    first += width * middle;
    second += width * middle * middle.transpose();
    second(1, 1) += width * width * width / 12;
  }
};

std::vector<Eigen::Vector2d> ends_of(const std::vector<Chord>& chords) {
  std::vector<Eigen::Vector2d> ends;
  for (const Chord& chord : chords) {
    ends.emplace_back(chord.line, chord.pos0);
    ends.emplace_back(chord.line, chord.pos1);
  }
  return ends;
}

constexpr double model_sigma_px = 0.03;  // bias of the ends: exposure, blur, pixel grid

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

/// Ellipse |M (p - c)| = r with M = [e^a, b; b, e^-a]; unknowns c, r, a, b.
struct RimEllipse {
  Vector5 x = Vector5::Zero();
  Matrix5 information = Matrix5::Zero();  ///< normal matrix for residuals of unit variance
  double rms = 0;                         ///< robust scale of the residuals along the normal
  double correlation = 0;                 ///< correlation of neighbouring residuals at one end

  Eigen::Matrix2d m() const {
    Eigen::Matrix2d out;
    out << std::exp(x[3]), x[4], x[4], std::exp(-x[3]);
    return out;
  }
};

/// Returns the distance of p from the ellipse along the normal (first order). Optional outputs: its
/// Jacobian and the normal.
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

/// Fits an ellipse by Gauss-Newton with Cauchy weights, from an initial value. `ends`: in the order
/// of ends_of().
RimEllipse fit_rim(const std::vector<Eigen::Vector2d>& ends, RimEllipse fit) {
  // Prior for a and b: a lamp is seldom seen at more than 60 degrees (a = ln(2) / 2 = 0.35).
  constexpr double shape_sigma = 0.35;
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
    const Vector5 step = core::solve_ldlt(fit.information, right);
    fit.x += step;
    fit.x.tail<2>() = fit.x.tail<2>().cwiseMax(-1.2).cwiseMin(1.2);
    fit.rms = std::max(0.02, 1.4826 * median(std::move(sizes)));  // MAD of a normal distribution
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

/// Initial value: middle and size of the chords' box.
RimEllipse initial_ellipse(const std::vector<Chord>& chords) {
  double pos = 0, longest = 0;
  for (const Chord& chord : chords) {
    pos += (chord.pos0 + chord.pos1) / 2 / static_cast<double>(chords.size());
    longest = std::max(longest, chord.pos1 - chord.pos0);
  }
  RimEllipse fit;
  fit.x << (chords.front().line + chords.back().line) / 2.0, pos, longest / 2, 0, 0;
  return fit;
}

/// True if the ellipse begins and ends at the first and last lit line, up to one dark gap. Rejects
/// rectangles, whose sides fit a long ellipse well.
bool spans(const RimEllipse& fit, const std::vector<Chord>& chords) {
  const Eigen::Matrix2d m = fit.m() / fit.x[2];
  const double half = std::sqrt((m.transpose() * m).inverse()(0, 0));
  const double before = chords.front().line - (fit.x[0] - half);
  const double after = fit.x[0] + half - chords.back().line;
  const double tolerance = 3 + 0.03 * half;
  const double max_dark = widest_gap(chords) + tolerance;
  return before > -tolerance && before < max_dark && after > -tolerance && after < max_dark;
}

}  // namespace

std::optional<SharpChords> sharp_chords(const LineWindow& window, const LineBox& core, double peak,
                                        bool clipped) {
  const LineBox part = core.grown(3, 3 + core.length() / 8).cut_to(window.box);
  SharpChords chords;
  chords.half = lit_chords(window, part, peak, 0.5);
  if (chords.half.size() < 5 || median_softness(chords.half) > (clipped ? 0.1 : 0.25))
    return std::nullopt;
  chords.low = lit_chords(window, part, peak, 0.35);
  chords.high = lit_chords(window, part, peak, 0.65);
  return chords;
}

StripedShape fit_outline(const std::vector<Chord>& chords) {
  Area area;
  const int gap = widest_gap(chords);
  for (std::size_t i = 0; i < chords.size(); ++i) {
    const Chord& a = chords[i];
    area.add(a.line, a.pos0, a.pos1);
    if (i + 1 == chords.size()) break;
    const Chord& b = chords[i + 1];
    for (int line = a.line + 1; line < b.line; ++line) {
      const double t = static_cast<double>(line - a.line) / (b.line - a.line);
      area.add(line, a.pos0 + t * (b.pos0 - a.pos0), a.pos1 + t * (b.pos1 - a.pos1));
    }
  }
  StripedShape outline;
  outline.kind = StripedShape::Kind::outline;
  outline.centre = area.first / area.sum;
  const Eigen::Matrix2d spread =
      area.second / area.sum - outline.centre * outline.centre.transpose();
  // Ellipse with the second moments of this area: semi-axes are two standard deviations.
  outline.shape = core::Cholesky<Eigen::Matrix2d>((4 * spread).inverse()).lower().transpose();
  // Up to one gap may be hidden at either end: uniform distribution, variance gap^2 / 12, halved by
  // the mean of both ends. The position of the hidden ends along the lines is unknown as well, with
  // half the sigma, because they are shorter than the other chords.
  outline.covariance << gap * gap / 24.0, 0, 0, gap * gap / 96.0;
  outline.covariance.diagonal().array() += 0.05 * 0.05;
  return outline;
}

std::optional<StripedShape> fit_disc(const SharpChords& chords) {
  const std::vector<Eigen::Vector2d> ends = ends_of(chords.half);
  const RimEllipse fit = fit_rim(ends, initial_ellipse(chords.half));
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
  // Systematic error: the change with the level of the contour. Half of the shift is used, and a
  // tenth of the growth, because half of the plateau is the right level if the plateau is uniform.
  if (chords.low.size() >= 5 && chords.high.size() >= 5) {
    const Vector5 change =
        fit_rim(ends_of(chords.high), fit).x - fit_rim(ends_of(chords.low), fit).x;
    disc.rim_shift_variance_px2 += change.head<2>().squaredNorm() / 4;
    disc.rim_growth_variance_px2 += change[2] * change[2] / 100;
  }
  disc.covariance =
      disc.rim_sigma_px * disc.rim_sigma_px * core::inverse(fit.information).topLeftCorner<2, 2>() +
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
