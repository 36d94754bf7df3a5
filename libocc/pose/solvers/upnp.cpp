// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/solvers/upnp.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <opengv/absolute_pose/modules/upnp4.hpp>

#include "libocc/pose/internal/frames.hpp"
#include "libocc/pose/internal/point_layout.hpp"

namespace occ {

using namespace internal::pose;
namespace {

using Monomials = Eigen::Matrix<double, 10, 1>;  // ww xx yy zz wx wy wz xy xz yz of a quaternion
using RotatedPoint = Eigen::Matrix<double, 3, 10>;

// The squared error sum_i |(1 - f_i f_i^T) (R p_i + t - o_i)|^2, minimised over t, in the form
// s^T M s + 2 C s + gamma with the monomials s (eqs (6)-(9) of the paper).
struct Cost {
  Eigen::Matrix<double, 10, 10> m = Eigen::Matrix<double, 10, 10>::Zero();
  Eigen::Matrix<double, 1, 10> c = Eigen::Matrix<double, 1, 10>::Zero();
  double gamma = 0;
  RotatedPoint translation_per_monomial = RotatedPoint::Zero();
  Eigen::Vector3d translation_at_zero = Eigen::Vector3d::Zero();
};

Monomials monomials(const Eigen::Vector4d& q) {
  Monomials s;
  s << q[0] * q[0], q[1] * q[1], q[2] * q[2], q[3] * q[3], q[0] * q[1], q[0] * q[2], q[0] * q[3],
      q[1] * q[2], q[1] * q[3], q[2] * q[3];
  return s;
}

// Phi in R p = Phi s.
RotatedPoint rotated_point(const Eigen::Vector3d& p) {
  const double x = p.x(), y = p.y(), z = p.z();
  RotatedPoint phi;
  phi << x, x, -x, -x, 0, 2 * z, -2 * y, 2 * y, 2 * z, 0,  //
      y, -y, y, -y, -2 * z, 0, 2 * x, 2 * x, 0, 2 * z,     //
      z, -z, -z, z, 2 * y, -2 * x, 0, 0, 2 * x, 2 * y;
  return phi;
}

Cost make_cost(const PoseProblem& problem, const Eigen::Matrix3Xd& points) {
  const Eigen::Index n = points.cols();
  const bool central = problem.origins.cols() != n;
  Cost cost;
  Eigen::Matrix3d across_sum = Eigen::Matrix3d::Zero();
  std::vector<Eigen::Matrix3d> across(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Vector3d f = problem.bearings.col(i);
    const Eigen::Matrix3d a = Eigen::Matrix3d::Identity() - f * f.transpose();
    across[i] = a;
    across_sum += a;
    cost.translation_per_monomial -= a * rotated_point(points.col(i));
    if (!central) cost.translation_at_zero += a * problem.origins.col(i);
  }
  const Eigen::Matrix3d inverse = across_sum.inverse();
  cost.translation_per_monomial = inverse * cost.translation_per_monomial;
  cost.translation_at_zero = inverse * cost.translation_at_zero;
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Matrix3d& a = across[i];
    const RotatedPoint per_monomial =
        a * (rotated_point(points.col(i)) + cost.translation_per_monomial);
    Eigen::Vector3d at_zero = cost.translation_at_zero;
    if (!central) at_zero -= problem.origins.col(i);
    at_zero = a * at_zero;
    cost.m += per_monomial.transpose() * per_monomial;
    cost.c += at_zero.transpose() * per_monomial;
    cost.gamma += at_zero.squaredNorm();
  }
  return cost;
}

// Changes the cost by a few roundings so that no pivot is exactly zero. A zero pivot leads to a
// column of NaN, for which OpenGV's Gauss-Jordan elimination reads before the beginning of an
// array. Points along an axis or seen face-on cause zeros. Polishing removes the effect of the
// change.
void remove_exact_zeros(Cost& cost) {
  constexpr double size = 1e-13;
  const double scale = size * cost.m.norm();
  for (int row = 0; row < 10; ++row)
    for (int column = 0; column <= row; ++column) {
      const double change = scale * std::sin(1.0 + 10 * row + column);
      cost.m(row, column) += change;
      if (row != column) cost.m(column, row) += change;
    }
}

// Appends the stationary points: eigenvectors of the action matrix, with the quaternion in their
// last four entries.
void add_poses(const Cost& cost, const Eigen::Matrix<double, 8, 8>& action,
               const Eigen::Matrix3d& turn, std::vector<Rigid3>& candidates) {
  if (!action.allFinite()) return;
  const Eigen::EigenSolver<Eigen::Matrix<double, 8, 8>> eigen(action);
  if (eigen.info() != Eigen::Success) return;
  const Eigen::Matrix<std::complex<double>, 8, 8> vectors = eigen.eigenvectors();
  for (int k = 0; k < 8; ++k) {
    if (eigen.eigenvalues()[k].imag() < 0) continue;  // conjugate of another eigenvalue
    const Eigen::Vector4d q = vectors.col(k).tail<4>().real().normalized();
    Rigid3 pose;
    pose.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix() * turn;
    pose.translation = cost.translation_per_monomial * monomials(q) + cost.translation_at_zero;
    candidates.push_back(pose);
  }
}

void solve_upnp(const PoseProblem& problem, std::vector<Rigid3>& candidates) {
  const Eigen::Index n = problem.points.cols();
  if (n < 3 || !spans_plane(point_layout(problem.points))) return;
  const Eigen::Matrix3d turn = generic_rotation();
  Cost cost = make_cost(problem, turn * problem.points);
  if (!cost.m.allFinite() || !cost.c.allFinite()) return;
  remove_exact_zeros(cost);
  // This template uses the symmetry q -> -q for three and four points as well. OpenGV's own choice
  // for them ignores it, is five times slower and solves four points in a quarter of the cases
  // only.
  Eigen::Matrix<double, 8, 8> action;
  opengv::absolute_pose::modules::upnp::setupAction_sym_gj(cost.m, cost.c, cost.gamma, action);
  add_poses(cost, action, turn, candidates);
}

}  // namespace

constexpr Solver upnp_solver = {
    /*name=*/"upnp",
    /*min_points=*/3,
    /*max_points=*/0,
    /*max_candidates=*/8, Layout::any,
    /*needs_up=*/false,
    /*takes_origins=*/true,
    /*failures=*/
    "takes ten times as long as sqpnp; with three points, one pose in twenty is wrong by more than "
    "1e-6 before polishing; with noisy points in a plane, one in twenty is wrong by a tenth",
    /*source=*/"Kneip, Li, Seo, ECCV 2014; elimination by OpenGV", solve_upnp};

}  // namespace occ
