// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/flat_minimum.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"

namespace occ::internal::refine {
namespace {

constexpr double tail_sigmas = 3;

/// A pose in the valley, as a step from the minimum.
struct Point {
  Vector8 x = Vector8::Zero();
  double rise = infinity;  ///< rise of chi2
};

/// The weakest direction of a minimum. Unknowns are in units of the standard deviation that each
/// would have alone.
class Valley {
 public:
  Valley(const LineariseAt& linearise, const Minimum& minimum)
      : linearise_(linearise), minimum_(minimum), units_(units_of(minimum.normal)) {
    const auto eigen = core::symmetric_eigen<Matrix8>(scaled(minimum.normal.information));
    along_ = eigen.eigenvectors().col(0);
    curvature_ = eigen.eigenvalues()[0];
  }

  bool defined() const { return curvature_ > 1e-12; }

  /// Minimum of chi2 over the other unknowns at `sigmas` first-order standard deviations.
  Point at(double sigmas) const {
    constexpr int steps = 4;
    const double along = sigmas / std::sqrt(curvature_);
    Point best;
    Vector8 x = along * along_;
    for (int i = 0; i <= steps; ++i) {
      PoseNormalEquations normal;
      const State state = moved(minimum_.state, minimum_.pivot, units_.cwiseProduct(x));
      if (!linearise_(state, normal)) break;
      const double rise = normal.robust_chi2 - minimum_.normal.robust_chi2;
      if (rise < best.rise) best = {x, rise};
      x += across_step(normal);
      x += (along - along_.dot(x)) * along_;
    }
    return best;
  }

  /// Squared distance, in sigmas, of a step's part across the valley.
  double bend2(const Vector8& x) const {
    const Vector8 across = x - along_.dot(x) * along_;
    return across.dot(scaled(minimum_.normal.information) * across);
  }

  /// Adds the poses between the minimum and the tail, and the tail at tail_sigmas.
  void add_tail(const Point& tail, Matrix8& covariance) const {
    const Vector8 middle = at(0.5 * along_.dot(tail.x) * std::sqrt(curvature_)).x;
    const Vector8 sag = middle - 0.5 * tail.x;
    covariance += tail.x * tail.x.transpose() / square(tail_sigmas) + sag * sag.transpose();
  }

  /// Second moment of the difference between the left perturbation to the tail and the one back. A
  /// covariance of first order takes them for equal.
  Matrix6 bend(const Point& tail) const {
    constexpr double max_bend2 = 8;
    const State there = moved(minimum_.state, minimum_.pivot, units_.cwiseProduct(tail.x));
    const Vector6 bend = difference(there.cam_from_world, minimum_.state.cam_from_world) +
                         difference(minimum_.state.cam_from_world, there.cam_from_world);
    return bend * bend.transpose() / max_bend2;
  }

  /// Information whose covariance contains both tails.
  Matrix8 containing(const Point& one, const Point& other) const {
    Matrix8 covariance = inverse(scaled(minimum_.normal.information));
    add_tail(one, covariance);
    add_tail(other, covariance);
    const Vector8 per_unit = units_.cwiseInverse();
    return per_unit.asDiagonal() * inverse(covariance) * per_unit.asDiagonal();
  }

 private:
  static Matrix8 inverse(const Matrix8& positive) {
    const core::Cholesky<Eigen::MatrixXd> cholesky(positive);
    const Matrix8 root = cholesky.solve_lower<Eigen::MatrixXd>(Matrix8::Identity());
    return core::transposed_product(root, root);
  }

  Matrix8 scaled(const Matrix8& information) const {
    return units_.asDiagonal() * information * units_.asDiagonal();
  }

  /// Gauss-Newton step orthogonal to the valley.
  Vector8 across_step(const PoseNormalEquations& normal) const {
    const Matrix8 across = Matrix8::Identity() - along_ * along_.transpose();
    const Matrix8 information =
        core::product(core::product(across, scaled(normal.information)), across) +
        along_ * along_.transpose();
    const Vector8 gradient = across * units_.cwiseProduct(normal.gradient);
    return -core::solve_ldlt(information, gradient);
  }

  const LineariseAt& linearise_;
  const Minimum& minimum_;
  Vector8 units_;
  Vector8 along_;
  double curvature_ = 0;
};

/// Pose at which the profile has risen as it should at tail_sigmas, at that distance or farther.
Point tail_of(const Valley& valley, double side, bool& is_flat) {
  constexpr double min_share = 0.7, growth = 1.25, max_reach = 30, max_bend2 = 4;
  Point tail = valley.at(side * tail_sigmas);
  if (tail.rise >= min_share * square(tail_sigmas)) {
    is_flat = is_flat || (std::isfinite(tail.rise) && valley.bend2(tail.x) > max_bend2);
    return tail;
  }
  is_flat = true;
  for (double sigmas = growth * tail_sigmas; sigmas < max_reach; sigmas *= growth) {
    const Point next = valley.at(side * sigmas);
    if (!std::isfinite(next.rise)) break;
    tail = next;
    if (tail.rise >= square(tail_sigmas)) break;
  }
  return tail;
}

}  // namespace

// Upper bound of the arc, in sigmas, on which the farthest of the lamps or the camera moves.
bool may_be_flat(const Minimum& minimum) {
  constexpr double max_sigmas = 1;
  const Matrix6 information = minimum.normal.information.topLeftCorner<6, 6>();
  const core::Cholesky<Matrix6> root(information);
  if (!root.exists()) return true;
  const double variance = root.solve<Matrix6>(Matrix6::Identity()).diagonal().head<3>().sum();
  const double arc = 0.5 * square(tail_sigmas) * variance * minimum.pivot.norm();
  return !(arc * std::sqrt(information.diagonal().tail<3>().maxCoeff()) < max_sigmas);
}

void widen_if_flat(RefineProblem& problem, Minimum& minimum) {
  widen_if_flat(
      [&](const State& state, PoseNormalEquations& normal) {
        return problem.linearise(state, problem.pivot(state), normal);
      },
      minimum);
}

void widen_if_flat(const LineariseAt& linearise, Minimum& minimum) {
  const Valley valley(linearise, minimum);
  if (!valley.defined()) return;
  bool is_flat = false;
  const Point one = tail_of(valley, -1, is_flat), other = tail_of(valley, 1, is_flat);
  if (!is_flat) return;
  minimum.bend = valley.bend(one) + valley.bend(other);
  minimum.normal.information = valley.containing(one, other);
}

}  // namespace occ::internal::refine
