// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/curved_covariance.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::locate {

using namespace internal::pose;
namespace {

constexpr double tail_sigmas = 4;

// Largest squared Mahalanobis distance of a pose at tail_sigmas. Beside 16 for the pose itself it
// leaves room for the errors along the other axes.
constexpr double max_tail_chi2 = 36;

// The other directions are determined several times better.
constexpr int weak_directions = 3;

// Rotation about the points' centroid and shift -> left perturbation.
Matrix6 left_jacobian(const Eigen::Vector3d& arm) {
  Matrix6 jacobian = Matrix6::Identity();
  jacobian.bottomLeftCorner<3, 3>() = skew(arm);
  return jacobian;
}

class Curve {
 public:
  Curve(const SeenPoints& seen, const PointFit& fit, double variance_factor)
      : seen_(seen), fit_(fit) {
    const core::Cholesky<Matrix6> cholesky(fit.equations.information);
    const Matrix6 root = cholesky.solve_lower<Matrix6>(Matrix6::Identity());
    inverse_ = root.transpose() * root;
    // Directions in units of an angle: shifts relative to the distance.
    Vector6 unit = Vector6::Ones();
    unit.tail<3>().setConstant(1 / fit.pose.translation.norm());
    const Matrix6 scaled = unit.asDiagonal() * inverse_ * unit.asDiagonal();
    const auto eigen = core::symmetric_eigen<Matrix6>(scaled);
    const Vector6 sigmas = (variance_factor * eigen.eigenvalues().cwiseMax(0)).cwiseSqrt();
    directions_ = unit.cwiseInverse().asDiagonal() * eigen.eigenvectors() * sigmas.asDiagonal();
  }

  /// One sigma along an uncertain direction, the most uncertain first.
  Vector6 direction(int i) const { return directions_.col(5 - i); }

  /// The pose whose residuals have changed by those of the tangent step `s`, relative to the fit
  /// (rotation vector about the centroid, shift). The tangent step itself where there is none.
  Vector6 at(const Vector6& s) const {
    constexpr int steps = 3;
    constexpr double max_stretch2 = 16;
    Vector6 x = s;
    for (int i = 0; i < steps; ++i) {
      const Vector6 gradient = residual_along(seen_, fit_.pose, moved(x)) - fit_.equations.gradient;
      x -= inverse_ * gradient - s;
    }
    const Matrix6& information = fit_.equations.information;
    return x.dot(information * x) < max_stretch2 * s.dot(information * s) ? x : s;
  }

  /// The left perturbation that moves the fit to the pose of at(), and the one that moves that pose
  /// to the fit. They differ in the sign of the second-order term.
  std::array<Vector6, 2> left_at(const Vector6& s) const {
    const Vector6 x = at(s);
    const Eigen::Vector3d turn = x.head<3>(), from = fit_.pose.translation;
    const Eigen::Vector3d to = from + x.tail<3>();
    std::array<Vector6, 2> left;
    left[0] << turn, to - so3_exp(turn) * from;
    left[1] << -turn, from - so3_exp(-turn) * to;
    return left;
  }

  double chi2_at(const Vector6& s) const { return point_chi2(seen_, moved(at(s))); }

 private:
  Rigid3 moved(const Vector6& x) const {
    return {so3_exp(Eigen::Vector3d(x.head<3>())) * fit_.pose.rotation,
            fit_.pose.translation + x.tail<3>()};
  }

  const SeenPoints& seen_;
  const PointFit& fit_;
  Matrix6 inverse_;
  Matrix6 directions_;
};

// Second moment of the second-order term for normal s.
Matrix6 second_order_moment(const Curve& curve) {
  constexpr double step = 1.7;  // sigmas; the central ones count most
  Vector6 trace = Vector6::Zero();
  Matrix6 moment = Matrix6::Zero();
  const auto even = [&](const Vector6& s) -> Vector6 {
    return (curve.at(step * s) + curve.at(-step * s)) / (2 * step * step);
  };
  for (int i = 0; i < weak_directions; ++i) {
    const Vector6 b = even(curve.direction(i));
    trace += b;
    moment += 2 * b * b.transpose();
    for (int j = 0; j < i; ++j) {
      const Vector6 sum = curve.direction(i) + curve.direction(j);
      const Vector6 difference = curve.direction(i) - curve.direction(j);
      const Vector6 mixed = 0.5 * (even(sum) - even(difference));
      moment += 4 * mixed * mixed.transpose();
    }
  }
  return moment + trace * trace.transpose();
}

// Enlarges the covariance just enough that `pose` has max_tail_chi2, in the direction in which it
// leaves the tangent (formula of Sherman and Morrison).
void contain(const Vector6& pose, const Vector6& tangent, Matrix6& covariance) {
  const Vector6 bend = pose - tangent;
  const Vector6 weighted = core::solve_llt<Matrix6, Vector6>(covariance, pose);
  const double excess = pose.dot(weighted) - max_tail_chi2;
  if (!(excess > 0) || !std::isfinite(excess)) return;
  const double along = bend.dot(weighted);
  const double bend2 = bend.dot(core::solve_llt<Matrix6, Vector6>(covariance, bend));
  const double left = along * along - excess * bend2;
  if (left > 0)
    covariance += excess / left * bend * bend.transpose();
  else
    covariance += excess / (max_tail_chi2 * pose.dot(weighted)) * pose * pose.transpose();
}

// Steps of tail_sigmas along and between the two most uncertain directions.
std::array<Vector6, 8> tails_of(const Curve& curve) {
  const Vector6 a = tail_sigmas * curve.direction(0), b = tail_sigmas * curve.direction(1);
  const double diagonal = std::sqrt(0.5);
  const Vector6 c = diagonal * (a + b), d = diagonal * (a - b);
  return {-a, a, -b, b, -c, c, -d, d};
}

void contain_tails(const Curve& curve, const Matrix6& jacobian, Matrix6& covariance) {
  for (const Vector6& tail : tails_of(curve)) {
    const Vector6 tangent = jacobian * tail;
    const std::array<Vector6, 2> left = curve.left_at(tail);
    contain(left[0], tangent, covariance);
    contain(left[1], -tangent, covariance);
  }
}

}  // namespace

// Upper bound of the arc, in sigmas, on which the farthest of the points or the camera moves.
bool is_curved(const PointFit& fit, double rotation_variance) {
  constexpr double max_sigmas = 2;
  const double arc = 0.5 * tail_sigmas * tail_sigmas * rotation_variance;
  const double radius = std::max(1.0, fit.pose.translation.norm());
  const double information = fit.equations.information.diagonal().tail<3>().maxCoeff();
  return !(arc * radius * std::sqrt(information) < max_sigmas);
}

bool is_flat(const SeenPoints& seen, const PointFit& fit, double variance_factor) {
  constexpr double min_share = 0.7;
  const Curve curve(seen, fit, variance_factor);
  const double expected = variance_factor * tail_sigmas * tail_sigmas;
  for (const Vector6& tail : tails_of(curve))
    if (curve.chi2_at(tail) - fit.equations.chi2 < min_share * expected) return true;
  return false;
}

Matrix6 left_covariance(const SeenPoints& seen, const PointFit& fit, double variance_factor) {
  const Eigen::Vector3d& arm = fit.pose.translation;
  const Matrix6 jacobian = left_jacobian(arm);
  // J (L L^T)^-1 J^T as Y^T Y, L Y = J^T: symmetric to the last bit.
  const core::Cholesky<Matrix6> cholesky(fit.equations.information);
  const Matrix6 y = cholesky.solve_lower<Matrix6>(jacobian.transpose());
  Matrix6 left;
  left.noalias() = variance_factor * y.transpose() * y;
  const bool curved = is_curved(fit, left.topLeftCorner<3, 3>().trace());
  if (curved) {
    const Curve curve(seen, fit, variance_factor);
    left += jacobian * second_order_moment(curve) * jacobian.transpose();
    left.bottomRightCorner<3, 3>() += arc_moment(left.topLeftCorner<3, 3>(), arm);
    contain_tails(curve, jacobian, left);
    left = (0.5 * (left + left.transpose())).eval();
  } else {
    left.bottomRightCorner<3, 3>() += arc_moment(left.topLeftCorner<3, 3>(), arm);
  }
  return left;
}

}  // namespace occ::internal::locate
