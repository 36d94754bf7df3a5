// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/stripe_signal.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::detect {
namespace {

constexpr double two_pi = 2 * pi;

/// Effective number of lines: the sum of the weights.
double effective_lines(const LineSignal& signal) {
  double sum = 0;
  for (const double w : signal.weight) sum += w;
  return sum;
}

/// Number of lines from the first to the last with a considerable weight.
int lines_in_view(const LineSignal& signal) {
  int first = signal.lines(), last = -1;
  for (int i = 0; i < signal.lines(); ++i) {
    if (!(signal.weight[i] > 0.3)) continue;
    first = std::min(first, i);
    last = i;
  }
  return last - first + 1;
}

/// Legendre polynomials over the signal; column k has degree k.
Eigen::MatrixXd baseline(int lines, int degree) {
  Eigen::MatrixXd p(lines, degree + 1);
  for (int i = 0; i < lines; ++i) {
    const double u = lines > 1 ? 2.0 * i / (lines - 1) - 1 : 0;
    p(i, 0) = 1;
    if (degree > 0) p(i, 1) = u;
    for (int k = 2; k <= degree; ++k)
      p(i, k) = ((2 * k - 1) * u * p(i, k - 1) - (k - 1) * p(i, k - 2)) / k;
  }
  return p;
}

/// Recurrence for cosine and sine from line to line.
struct Rotation {
  double c = 1, s = 0, step_c, step_s;

  explicit Rotation(double cycles_per_line)
      : step_c(std::cos(two_pi * cycles_per_line)), step_s(std::sin(two_pi * cycles_per_line)) {}

  void next() {
    const double next_c = c * step_c - s * step_s;
    s = s * step_c + c * step_s;
    c = next_c;
  }
};

/// Square roots of the weights, weighted values, weighted orthonormal baseline.
struct Weighted {
  Eigen::VectorXd root, value;
  Eigen::MatrixXd base;
  Eigen::VectorXd residual;  ///< values minus the fitted baseline

  Weighted(const LineSignal& signal, int degree) {
    const auto n = static_cast<Eigen::Index>(signal.value.size());
    root = Eigen::Map<const Eigen::VectorXd>(signal.weight.data(), n).cwiseSqrt();
    value = root.cwiseProduct(Eigen::Map<const Eigen::VectorXd>(signal.value.data(), n));
    const Eigen::MatrixXd p = root.asDiagonal() * baseline(static_cast<int>(n), degree);
    base = core::householder_q(p, degree + 1);
    residual = value - base * (base.transpose() * value);
  }
};

/// Amplitudes at one frequency, and the part of the residual's sum of squares that they explain.
struct Sinusoid {
  Eigen::Vector2d amplitude = Eigen::Vector2d::Zero();
  double power = 0;
};

/// Fits a sinusoid of one frequency in one pass over the lines. The scan spends its time here.
Sinusoid fit_sinusoid(const Weighted& w, double cycles_per_line) {
  Rotation wave(cycles_per_line);
  double cc = 0, cs = 0, ss = 0, cr = 0, sr = 0;
  double cb[3] = {}, sb[3] = {};
  const double *b0 = w.base.col(0).data(), *b1 = w.base.col(1).data(), *b2 = w.base.col(2).data();
  for (Eigen::Index i = 0; i < w.root.size(); ++i, wave.next()) {
    const double c = w.root[i] * wave.c, s = w.root[i] * wave.s, r = w.residual[i];
    cc += c * c;
    cs += c * s;
    ss += s * s;
    cr += c * r;
    sr += s * r;
    cb[0] += c * b0[i];
    cb[1] += c * b1[i];
    cb[2] += c * b2[i];
    sb[0] += s * b0[i];
    sb[1] += s * b1[i];
    sb[2] += s * b2[i];
  }
  for (int k = 0; k < 3; ++k) {
    cc -= cb[k] * cb[k];
    cs -= cb[k] * sb[k];
    ss -= sb[k] * sb[k];
  }
  Eigen::Matrix2d gram;
  gram << cc, cs, cs, ss;
  Sinusoid line;
  if (!(gram.determinant() > 1e-6 * gram.trace() * gram.trace())) return line;
  line.amplitude = gram.inverse() * Eigen::Vector2d(cr, sr);
  line.power = cr * line.amplitude[0] + sr * line.amplitude[1];
  return line;
}

/// Design matrix: baseline, then cosine and sine of each harmonic.
Eigen::MatrixXd model(const Weighted& w, double cycles_per_line, int harmonics) {
  Eigen::MatrixXd a(w.root.size(), w.base.cols() + 2 * harmonics);
  a.leftCols(w.base.cols()) = w.base;
  for (int k = 1; k <= harmonics; ++k) {
    Rotation wave(k * cycles_per_line);
    const Eigen::Index at = w.base.cols() + 2 * (k - 1);
    for (Eigen::Index i = 0; i < w.root.size(); ++i, wave.next()) {
      a(i, at) = w.root[i] * wave.c;
      a(i, at + 1) = w.root[i] * wave.s;
    }
  }
  return a;
}

struct Solved {
  Eigen::VectorXd coefficients, residual;
  double squares = 0;
};

Solved solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& value) {
  Solved solved;
  solved.coefficients =
      core::solve_ldlt<Eigen::MatrixXd, Eigen::VectorXd>(a.transpose() * a, a.transpose() * value);
  solved.residual = value - a * solved.coefficients;
  solved.squares = solved.residual.squaredNorm();
  return solved;
}

/// Fit at one frequency, with the derivative by the frequency as last column.
struct Linearised {
  Eigen::MatrixXd a;
  Solved fit;
  Eigen::MatrixXd information;
};

Linearised linearise(const Weighted& w, double cycles_per_line, int harmonics) {
  Linearised out;
  const Eigen::MatrixXd a = model(w, cycles_per_line, harmonics);
  out.fit = solve(a, w.value);
  const Eigen::Index columns = a.cols();
  out.a.resize(a.rows(), columns + 1);
  out.a.leftCols(columns) = a;
  Eigen::VectorXd by_f = Eigen::VectorXd::Zero(a.rows());
  for (int k = 1; k <= harmonics; ++k) {
    const Eigen::Index at = w.base.cols() + 2 * (k - 1);
    by_f += two_pi * k *
            (out.fit.coefficients[at + 1] * a.col(at) - out.fit.coefficients[at] * a.col(at + 1));
  }
  // The derivative of cos(2 pi k f i) by f has the factor i.
  out.a.col(columns) =
      by_f.cwiseProduct(Eigen::VectorXd::LinSpaced(a.rows(), 0, static_cast<double>(a.rows() - 1)));
  out.information = out.a.transpose() * out.a;
  return out;
}

/// Refines the frequency by Gauss-Newton steps, within +-reach of the start.
Linearised refine_frequency(const Weighted& w, double& cycles_per_line, double reach,
                            int harmonics) {
  const double start = cycles_per_line;
  Linearised best = linearise(w, start, harmonics);
  for (int iteration = 0; iteration < 8; ++iteration) {
    const Eigen::VectorXd step = core::solve_ldlt<Eigen::MatrixXd, Eigen::VectorXd>(
        best.information, best.a.transpose() * best.fit.residual);
    double move = step[step.size() - 1];
    bool better = false;
    for (int halving = 0; halving < 4 && !better; ++halving, move /= 2) {
      const double f = std::clamp(cycles_per_line + move, start - reach, start + reach);
      Linearised next = linearise(w, f, harmonics);
      better = next.fit.squares < best.fit.squares;
      if (!better) continue;
      cycles_per_line = f;
      best = std::move(next);
    }
    if (!better || std::abs(move) < 1e-4 * reach) break;
  }
  return best;
}

/// Variance of a sum of correlated residuals over that of independent ones, for first-order
/// autoregressive residuals: (1 + rho) / (1 - rho).
double correlation_inflation(const Eigen::VectorXd& residual) {
  const Eigen::Index n = residual.size();
  if (n < 3) return 1;
  const double rho = residual.head(n - 1).dot(residual.tail(n - 1)) / residual.squaredNorm();
  const double bounded = std::clamp(rho, 0.0, 0.8);
  return (1 + bounded) / (1 - bounded);
}

}  // namespace

LineSignal envelope_normalised(const LineSignal& signal, double half_window_lines) {
  const int n = signal.lines(), half = std::max(1, static_cast<int>(half_window_lines + 0.5));
  LineSignal out = signal;
  std::vector<double> top(signal.value.size());
  for (int i = 0; i < n; ++i) {
    const auto from = signal.value.begin() + std::max(0, i - half);
    const auto to = signal.value.begin() + std::min(n, i + half + 1);
    top[i] = *std::max_element(from, to);
  }
  const double highest = *std::max_element(top.begin(), top.end());
  for (std::size_t i = 0; i < top.size(); ++i) {
    out.value[i] = top[i] > 0 ? signal.value[i] / top[i] : 0;
    const double relative = top[i] > 0 ? top[i] / highest : 0;
    out.weight[i] *= relative * relative / (relative * relative + 0.0225);
  }
  return out;
}

double Blink::phase(double line) const {
  const double crest = std::atan2(sine[0], cosine[0]) / two_pi;
  const double cycles = cycles_per_line * (line - line0) - crest;
  return cycles - std::floor(cycles + 0.5);
}

double Blink::amplitude() const { return std::hypot(cosine[0], sine[0]); }

double strongest_frequency(const LineSignal& signal, double max_cycles_per_line) {
  const int in_view = lines_in_view(signal);
  if (in_view < 8) return 0;
  const double resolution = 1.0 / in_view, low = 1.8 * resolution, step = resolution / 6;
  const double high = std::min(max_cycles_per_line, 0.5 - resolution / 2);
  if (!(high > low)) return 0;
  const Weighted w(signal, 2);
  std::vector<double> power;
  for (double f = low; f <= high; f += step) power.push_back(fit_sinusoid(w, f).power);
  const auto best =
      static_cast<std::size_t>(std::max_element(power.begin(), power.end()) - power.begin());
  double offset = 0;  // vertex of the parabola through three values
  if (best > 0 && best + 1 < power.size()) {
    const double bend = power[best - 1] - 2 * power[best] + power[best + 1];
    if (bend < 0) offset = 0.5 * (power[best - 1] - power[best + 1]) / bend;
  }
  return low + step * (static_cast<double>(best) + offset);
}

std::complex<double> amplitude_at(const LineSignal& signal, double cycles_per_line) {
  const Weighted w(signal, 2);
  const Eigen::Vector2d amplitude = fit_sinusoid(w, cycles_per_line).amplitude;
  return {amplitude[0], amplitude[1]};
}

Blink fit_blink(const LineSignal& signal, double cycles_per_line, int baseline_degree,
                int max_harmonics) {
  Blink blink;
  const Weighted w(signal, baseline_degree);
  const int in_view = lines_in_view(signal);
  const double lines = effective_lines(signal);
  if (in_view < 8 || lines < 8) return blink;
  const auto allowed = [&](int k) {
    return k * cycles_per_line < 0.45 && lines > 2 * (baseline_degree + 2 + 2 * k);
  };
  blink.harmonics = 1;
  while (blink.harmonics < max_harmonics && allowed(blink.harmonics + 1)) ++blink.harmonics;

  double f = cycles_per_line;
  const Linearised at = refine_frequency(w, f, 0.6 / in_view, blink.harmonics);
  const Solved& fit = at.fit;
  const Eigen::Index columns = at.a.cols();
  const Eigen::VectorXd unit = Eigen::VectorXd::Unit(columns, columns - 1);
  const double freedom = std::max(1.0, lines - static_cast<double>(columns));
  const double variance = fit.squares / freedom * correlation_inflation(fit.residual);
  const double of_f = core::solve_ldlt(at.information, unit)[columns - 1];

  blink.cycles_per_line = f;
  blink.sigma = std::sqrt(std::max(0.0, variance * of_f));
  blink.line0 = signal.line0;
  const Eigen::Index base = w.base.cols();
  for (int k = 0; k < blink.harmonics; ++k) {
    blink.cosine[k] = fit.coefficients[base + 2 * k];
    blink.sine[k] = fit.coefficients[base + 2 * k + 1];
  }
  blink.mean = w.root.dot(w.base * fit.coefficients.head(base)) / lines;
  const double before = w.residual.squaredNorm();
  blink.explained = before > 0 ? 1 - fit.squares / before : 0;
  blink.f_statistic =
      (before - fit.squares) / (2 * blink.harmonics + 1) / std::max(variance, 1e-300);
  blink.periods = f * in_view;
  return blink;
}

}  // namespace occ::internal::detect
