// SPDX-License-Identifier: Apache-2.0
#include "libocc/pose/internal/point_fit.hpp"

#include <cmath>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/least_squares.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/pose/internal/bearing_basis.hpp"

namespace occ::internal::pose {
namespace {

using Four = SeenPoints::Four;
using Block = SeenPoints::Block;

constexpr double chi2_rounding = 1e-14;  // relative decrease of chi2 that rounding hides

struct Transformed {
  Four turned[3];  // R X
  Four residual[2];
  Four inverse_depth;  // along the bearing
};

Transformed transform(const Block& b, const Rigid3& pose) {
  Transformed t;
  Four x[3];
  for (int i = 0; i < 3; ++i) {
    t.turned[i] = pose.rotation(i, 0) * b.point[0] + pose.rotation(i, 1) * b.point[1] +
                  pose.rotation(i, 2) * b.point[2];
    x[i] = t.turned[i] + pose.translation[i];
  }
  const auto dot = [&](const Four a[3]) -> Four { return a[0] * x[0] + a[1] * x[1] + a[2] * x[2]; };
  t.inverse_depth = (dot(b.bearing) - b.along).inverse();
  for (int k = 0; k < 2; ++k) t.residual[k] = (dot(b.across[k]) - b.offset[k]) * t.inverse_depth;
  return t;
}

bool in_front(const Transformed& t) { return t.inverse_depth.minCoeff() > 0; }

// Upper triangle of J^T J, then J^T r, then r^T r, with four lanes each.
struct Sums {
  Four information[21], gradient[6], chi2;
  Sums() {
    for (Four& s : information) s.setZero();
    for (Four& s : gradient) s.setZero();
    chi2.setZero();
  }
};

// Row k of the Jacobian.
void set_row(const Block& b, const Transformed& t, int k, Four row[6]) {
  for (int i = 0; i < 3; ++i)
    row[3 + i] = (b.across[k][i] - t.residual[k] * b.bearing[i]) * t.inverse_depth;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    row[i] = t.turned[j] * row[3 + l] - t.turned[l] * row[3 + j];
  }
}

void add_rows(const Block& b, const Transformed& t, Sums& sums) {
  for (int k = 0; k < 2; ++k) {
    Four row[6];
    set_row(b, t, k, row);
    for (int i = 0, n = 0; i < 6; ++i) {
      for (int j = i; j < 6; ++j, ++n) sums.information[n] += row[i] * row[j];
      sums.gradient[i] += row[i] * t.residual[k];
    }
    sums.chi2 += t.residual[k] * t.residual[k];
  }
}

// Rotation of Cayley's parameters w: R = (I - [w/2])^-1 (I + [w/2]), without trigonometry.
Eigen::Matrix3d cayley(const Eigen::Vector3d& w) {
  const Eigen::Vector3d h = 0.5 * w;
  const double f = 2 / (1 + h.squaredNorm());
  const double x = h[0], y = h[1], z = h[2];
  Eigen::Matrix3d r;
  r << 1 - f * (y * y + z * z), f * (x * y - z), f * (x * z + y),  //
      f * (x * y + z), 1 - f * (x * x + z * z), f * (y * z - x),   //
      f * (x * z - y), f * (y * z + x), 1 - f * (x * x + y * y);
  return r;
}

// The fit in the unknowns of a step from a base pose: Cayley's parameters, then a translation.
struct PointProblem {
  static constexpr int unknowns = 6;
  const SeenPoints& seen;
  const Rigid3 base;
  Vector6 last_step = Vector6::Zero();  // where the equations were last taken
  PointEquations last;                  // with respect to a rotation vector at last_step

  Rigid3 pose_at(const Vector6& step) const {
    return {cayley(step.head<3>()) * base.rotation, base.translation + step.tail<3>()};
  }

  double chi2(const Vector6& step) const { return point_chi2(seen, pose_at(step)); }

  bool sums(const Vector6& step, core::NormalSums<6>& sums) {
    last_step = step;
    last = point_equations(seen, pose_at(step));
    if (!std::isfinite(last.chi2)) return false;
    sums = {last.information, last.gradient, last.chi2};
    // A change dw of Cayley's parameters rotates by (I + [w/2]) dw / (1 + |w/2|^2).
    const Eigen::Vector3d half = 0.5 * step.head<3>();
    if (half.isZero(0)) return true;
    const Eigen::Matrix3d rotation =
        (Eigen::Matrix3d::Identity() + skew(half)) / (1 + half.squaredNorm());
    sums.information.leftCols<3>() = (sums.information.leftCols<3>() * rotation).eval();
    sums.information.topRows<3>() = (rotation.transpose() * sums.information.topRows<3>()).eval();
    sums.gradient.head<3>() = (rotation.transpose() * sums.gradient.head<3>()).eval();
    return true;
  }
};

}  // namespace

void SeenPoints::reserve(int count) { blocks_.reserve(static_cast<std::size_t>((count + 3) / 4)); }

void SeenPoints::append(const Eigen::Vector3d& point, const Eigen::Vector3d& bearing,
                        const Eigen::Matrix<double, 2, 3>& across, const Eigen::Vector2d& offset,
                        double along) {
  const int lane = count_++ % 4;
  if (lane == 0) blocks_.emplace_back();
  Block& b = blocks_.back();
  // Empty lanes repeat a point in front of the camera with weight 0.
  for (int l = lane; l < (lane == 0 ? 4 : lane + 1); ++l) {
    const double weight = l == lane ? 1 : 0;
    for (int i = 0; i < 3; ++i) {
      b.point[i][l] = point[i];
      b.bearing[i][l] = bearing[i];
      for (int k = 0; k < 2; ++k) b.across[k][i][l] = weight * across(k, i);
    }
    for (int k = 0; k < 2; ++k) b.offset[k][l] = weight * offset[k];
    b.along[l] = along;
  }
}

void SeenPoints::add(const Eigen::Vector3d& point, const Eigen::Vector3d& bearing,
                     const Eigen::Matrix<double, 2, 3>& across, const Eigen::Vector3d& origin) {
  append(point, bearing, across, across * origin, bearing.dot(origin));
}

void SeenPoints::add(const SeenPoints& other, int i) {
  const Block& b = other.blocks_[i / 4];
  const int lane = i % 4;
  Eigen::Matrix<double, 2, 3> across;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 3; ++j) across(k, j) = b.across[k][j][lane];
  append({b.point[0][lane], b.point[1][lane], b.point[2][lane]},
         {b.bearing[0][lane], b.bearing[1][lane], b.bearing[2][lane]}, across,
         {b.offset[0][lane], b.offset[1][lane]}, b.along[lane]);
}

SeenPoints seen_along(const PoseProblem& problem) {
  SeenPoints seen;
  seen.reserve(problem.size());
  for (int i = 0; i < problem.size(); ++i) {
    const Eigen::Vector3d bearing = problem.bearings.col(i);
    seen.add(problem.points.col(i), bearing, tangent_basis(bearing),
             problem.origins.cols() > 0 ? Eigen::Vector3d(problem.origins.col(i))
                                        : Eigen::Vector3d::Zero());
  }
  return seen;
}

PointEquations point_equations(const SeenPoints& seen, const Rigid3& pose) {
  Sums sums;
  bool front = true;
  for (const Block& block : seen.blocks()) {
    const Transformed t = transform(block, pose);
    front = front && in_front(t);
    add_rows(block, t, sums);
  }
  PointEquations e;
  for (int i = 0, n = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j, ++n)
      e.information(i, j) = e.information(j, i) = sums.information[n].sum();
    e.gradient[i] = sums.gradient[i].sum();
  }
  e.chi2 = front ? sums.chi2.sum() : std::numeric_limits<double>::infinity();
  return e;
}

double point_chi2(const SeenPoints& seen, const Rigid3& pose) {
  Four chi2 = Four::Zero();
  for (const Block& block : seen.blocks()) {
    const Transformed t = transform(block, pose);
    if (!in_front(t)) return std::numeric_limits<double>::infinity();
    chi2 += t.residual[0] * t.residual[0] + t.residual[1] * t.residual[1];
  }
  return chi2.sum();
}

Vector6 residual_along(const SeenPoints& seen, const Rigid3& base, const Rigid3& pose) {
  Four sums[6];
  for (Four& s : sums) s.setZero();
  bool front = true;
  for (const Block& block : seen.blocks()) {
    const Transformed from = transform(block, base), to = transform(block, pose);
    front = front && in_front(to);
    for (int k = 0; k < 2; ++k) {
      Four row[6];
      set_row(block, from, k, row);
      for (int i = 0; i < 6; ++i) sums[i] += row[i] * to.residual[k];
    }
  }
  Vector6 along;
  for (int i = 0; i < 6; ++i)
    along[i] = front ? sums[i].sum() : std::numeric_limits<double>::quiet_NaN();
  return along;
}

void each_chi2(const SeenPoints& seen, const Rigid3& pose, std::vector<double>& chi2) {
  chi2.clear();
  for (const Block& block : seen.blocks()) {
    const Transformed t = transform(block, pose);
    const Four squared = t.residual[0] * t.residual[0] + t.residual[1] * t.residual[1];
    for (int lane = 0; lane < 4; ++lane)
      chi2.push_back(t.inverse_depth[lane] > 0 ? squared[lane]
                                               : std::numeric_limits<double>::infinity());
  }
  chi2.resize(static_cast<std::size_t>(seen.count()));
}

namespace {

// Plain Gauss-Newton, which suffices for most fits and takes a third of the time of a trust-region
// method. Returns false if a step does not lower chi2; `fit` is then the best pose so far.
bool by_gauss_newton(const SeenPoints& seen, int max_iterations, double tolerance, PointFit& fit) {
  constexpr double lost_in_rounding = 1e-11;  // of chi2
  fit.equations = point_equations(seen, fit.pose);
  while (std::isfinite(fit.equations.chi2)) {
    const core::Cholesky<Matrix6> cholesky(fit.equations.information);
    if (!cholesky.exists()) return false;
    const Vector6 step = -cholesky.solve(fit.equations.gradient);
    const double fall = -fit.equations.gradient.dot(
        step);  // predicted, equal to the step's squared length in sigmas
    fit.converged = fall <= std::max(tolerance * tolerance, chi2_rounding * fit.equations.chi2);
    if (fit.converged || fit.iterations == max_iterations) return true;
    const Rigid3 moved{cayley(step.head<3>()) * fit.pose.rotation,
                       fit.pose.translation + step.tail<3>()};
    const PointEquations equations = point_equations(seen, moved);
    // A step whose decrease is hidden by rounding is the last: the error after it is its
    // square.
    const bool last = fall <= lost_in_rounding * fit.equations.chi2;
    if (!(equations.chi2 < fit.equations.chi2) && !last) return false;
    fit.pose = moved;
    fit.equations = equations;
    ++fit.iterations;
    fit.converged = last;
    if (last) return true;
  }
  return false;
}

// Levenberg-Marquardt, used where plain Gauss-Newton failed.
void by_trust_region(const SeenPoints& seen, int max_iterations, double tolerance, PointFit& fit) {
  core::LeastSquaresOptions options;
  options.max_iterations = max_iterations;
  options.step_tolerance = tolerance;
  options.chi2_tolerance = tolerance * tolerance;
  options.trust_radius = 100;  // shorter than a Gauss-Newton step, which was too long
  Vector6 step = Vector6::Zero();
  PointProblem problem{seen, fit.pose, step, {}};
  const core::LeastSquaresResult result = core::minimise_sums(problem, step, options);
  fit.pose = problem.pose_at(step);
  fit.equations = step == problem.last_step ? problem.last : point_equations(seen, fit.pose);
  fit.iterations += result.iterations;
  fit.converged = result.converged;
}

}  // namespace

PointFit fit_points(const SeenPoints& seen, const Rigid3& start, int max_iterations,
                    double tolerance) {
  PointFit fit{start, {}, 0, false};
  if (!by_gauss_newton(seen, max_iterations, tolerance, fit))
    by_trust_region(seen, max_iterations - fit.iterations, tolerance, fit);
  return fit;
}

}  // namespace occ::internal::pose
