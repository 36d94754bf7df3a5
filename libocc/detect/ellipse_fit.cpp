// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/ellipse_fit.hpp"

#include <Eigen/LU>
#include <cmath>

#include "libocc/core/internal/dense.hpp"

namespace occ::internal::detect {
namespace {

using Matrix5 = Eigen::Matrix<double, 5, 5>;
using Vector5 = Eigen::Matrix<double, 5, 1>;

constexpr int parameters = 5;  // centre x, y; shape xx, xy, yy
constexpr int max_steps = 20;
constexpr double converged = 1e-8;  // step relative to the ellipse's size

bool is_ellipse(const FittedConic& conic) {
  return conic.centre.allFinite() && conic.shape.allFinite() && conic.shape(0, 0) > 0 &&
         conic.shape.determinant() > 0;
}

/// Normalised coordinates: origin at the mean of the points, unit length their root mean square
/// distance from it. This keeps the normal equations well conditioned.
struct Frame {
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();
  double size = 0;

  explicit Frame(const std::vector<RimPoint>& rim) {
    const double n = static_cast<double>(rim.size());
    for (const RimPoint& point : rim) origin += point.px / n;
    for (const RimPoint& point : rim) size += (point.px - origin).squaredNorm() / n;
    size = std::sqrt(size);
  }

  Eigen::Vector2d in(const Eigen::Vector2d& px) const { return (px - origin) / size; }
  FittedConic in(const FittedConic& conic) const {
    return {in(conic.centre), conic.shape * (size * size)};
  }
  FittedConic out(const FittedConic& conic) const {
    return {origin + size * conic.centre, conic.shape / (size * size)};
  }
};

/// Linear least squares of a x^2 + 2 b x y + c y^2 + 2 d x + 2 e y = 1. Only an initial value,
/// because it weights each point by the gradient of the quadratic form.
std::optional<FittedConic> algebraic_fit(const std::vector<RimPoint>& rim, const Frame& frame) {
  Matrix5 normal = Matrix5::Zero();
  Vector5 right = Vector5::Zero();
  for (const RimPoint& point : rim) {
    const Eigen::Vector2d p = frame.in(point.px);
    Vector5 row;
    row << p.x() * p.x(), 2 * p.x() * p.y(), p.y() * p.y(), 2 * p.x(), 2 * p.y();
    normal += row * row.transpose();
    right += row;
  }
  const core::Ldlt<Matrix5> solver(normal);
  if (solver.factors().info() != Eigen::Success || !(solver.rcond() > 1e-12)) return std::nullopt;
  const Vector5 s = solver.solve(right);
  FittedConic conic;
  conic.shape << s[0], s[1], s[1], s[2];
  if (!(conic.shape.determinant() > 0)) return std::nullopt;
  conic.centre = -conic.shape.inverse() * s.tail<2>();
  const double level = 1 + conic.centre.dot(conic.shape * conic.centre);
  conic.shape /= level;
  if (!is_ellipse(conic)) return std::nullopt;
  return conic;
}

/// Distance of one point from the conic, its derivatives and its weight (in the frame's units).
struct Row {
  Vector5 derivatives;
  double residual;
  double weight;

  Row(const RimPoint& point, const Frame& frame, const FittedConic& conic) {
    const Eigen::Vector2d d = frame.in(point.px) - conic.centre;
    const Eigen::Vector2d out = conic.shape * d;
    const double slope = 2 * out.norm();
    residual = (out.dot(d) - 1) / slope;
    derivatives << -2 * out.x(), -2 * out.y(), d.x() * d.x(), 2 * d.x() * d.y(), d.y() * d.y();
    derivatives /= slope;
    weight = frame.size * frame.size / (point.sigma_px * point.sigma_px);
  }
};

struct NormalEquations {
  Matrix5 matrix = Matrix5::Zero();
  Vector5 right = Vector5::Zero();
  double chi2 = 0, sum_squares = 0;

  NormalEquations(const std::vector<RimPoint>& rim, const Frame& frame, const FittedConic& conic) {
    for (const RimPoint& point : rim) {
      const Row row(point, frame, conic);
      matrix += row.weight * row.derivatives * row.derivatives.transpose();
      right += row.weight * row.residual * row.derivatives;
      chi2 += row.weight * row.residual * row.residual;
      sum_squares += row.residual * row.residual;
    }
  }
};

std::optional<EllipseFit> iterate(const std::vector<RimPoint>& rim, const Frame& frame,
                                  FittedConic conic) {
  for (int step = 0; step < max_steps; ++step) {
    const NormalEquations sums(rim, frame, conic);
    const core::Ldlt<Matrix5> solver(sums.matrix);
    if (solver.factors().info() != Eigen::Success || !(solver.rcond() > 1e-13)) return std::nullopt;
    const Vector5 change = solver.solve(sums.right);
    if (change.norm() < converged) {
      EllipseFit fit;
      fit.conic = frame.out(conic);
      const Matrix5 covariance = solver.solve<Matrix5>(Matrix5::Identity());
      fit.centre_covariance_px2 = covariance.topLeftCorner<2, 2>() * (frame.size * frame.size);
      fit.chi2 = sums.chi2;
      fit.dof = static_cast<int>(rim.size()) - parameters;
      fit.rms_px = frame.size * std::sqrt(sums.sum_squares / static_cast<double>(rim.size()));
      return fit;
    }
    conic.centre -= change.head<2>();
    conic.shape(0, 0) -= change[2];
    conic.shape(0, 1) -= change[3];
    conic.shape(1, 0) = conic.shape(0, 1);
    conic.shape(1, 1) -= change[4];
    if (!is_ellipse(conic)) return std::nullopt;
  }
  return std::nullopt;
}

}  // namespace

Ellipse FittedConic::ellipse() const {
  const double middle = 0.5 * (shape(0, 0) + shape(1, 1));
  const double half = std::hypot(0.5 * (shape(0, 0) - shape(1, 1)), shape(0, 1));
  Ellipse ellipse;
  ellipse.centre_px = centre;
  ellipse.semi_major_px = 1 / std::sqrt(middle - half);
  ellipse.semi_minor_px = 1 / std::sqrt(middle + half);
  // The major axis belongs to the smaller eigenvalue.
  if (half > 0) ellipse.angle_rad = 0.5 * std::atan2(-2 * shape(0, 1), shape(1, 1) - shape(0, 0));
  return ellipse;
}

std::optional<EllipseFit> fit_ellipse(const std::vector<RimPoint>& rim) {
  if (rim.size() <= parameters) return std::nullopt;
  const Frame frame(rim);
  const std::optional<FittedConic> start = algebraic_fit(rim, frame);
  if (!start) return std::nullopt;
  return iterate(rim, frame, *start);
}

std::optional<EllipseFit> fit_ellipse(const std::vector<RimPoint>& rim, const FittedConic& start) {
  if (rim.size() <= parameters) return std::nullopt;
  const Frame frame(rim);
  return iterate(rim, frame, frame.in(start));
}

Eigen::Matrix2d centre_response(const std::vector<RimPoint>& rim, const FittedConic& conic,
                                const std::vector<Eigen::Vector2d>& moves) {
  const Frame frame(rim);
  const FittedConic scaled = frame.in(conic);
  Eigen::Matrix<double, parameters, 2> right = Eigen::Matrix<double, parameters, 2>::Zero();
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const Row row(rim[i], frame, scaled);
    right += row.weight * row.derivatives * moves[i].transpose();
  }
  // An outward shift of a point increases its residual by the same amount.
  const NormalEquations sums(rim, frame, scaled);
  return -core::solve_ldlt(sums.matrix, right).topRows<2>();
}

}  // namespace occ::internal::detect
