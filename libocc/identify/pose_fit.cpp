// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/pose_fit.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <limits>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/internal/least_squares.hpp"

namespace occ::internal::identify {
namespace {

struct NormalEquations {
  Matrix6 information = Matrix6::Zero();
  Vector6 gradient = Vector6::Zero();
  double chi2 = 0;
};

// Returns skew(point) m, with the columns point x m_k.
Eigen::Matrix3d cross_columns(const Eigen::Vector3d& point, const Eigen::Matrix3d& m) {
  Eigen::Matrix3d result;
  for (int k = 0; k < 3; ++k) result.col(k) = point.cross(Eigen::Vector3d(m.col(k)));
  return result;
}

// Sets chi2 to infinity when a lamp is not in front of the camera. The derivative of a point by the
// pose is delta_rot x point + delta_trans.
NormalEquations normal_equations(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                                 const Rigid3& pose) {
  NormalEquations n;
  for (const Pair& pair : pairs) {
    const MapPoint& map_point = problem.map_point(pair.map_point);
    const Eigen::Vector3d point = pose * map_point.centre;
    Mismatch m;
    if (!compare(problem.observation(pair.observation), map_point, pose.rotation, point, m)) {
      n.chi2 = std::numeric_limits<double>::infinity();
      return n;
    }
    const Eigen::Matrix2d weight = m.covariance.inverse();
    const Eigen::Matrix<double, 3, 2> weighted = m.by_point.transpose() * weight;
    const Eigen::Matrix3d translation = weighted * m.by_point;
    const Eigen::Vector3d gradient = weighted * m.error;
    const Eigen::Matrix3d mixed = cross_columns(point, translation);
    n.information.topLeftCorner<3, 3>() += cross_columns(point, mixed.transpose());
    n.information.topRightCorner<3, 3>() += mixed;
    n.information.bottomRightCorner<3, 3>() += translation;
    n.gradient.head<3>() += point.cross(gradient);
    n.gradient.tail<3>() += gradient;
    n.chi2 += m.error.dot(weight * m.error);
  }
  n.information.bottomLeftCorner<3, 3>() = n.information.topRightCorner<3, 3>().transpose();
  return n;
}

// Adds the prior. A left perturbation of the pose is the same in the world and in the local frame.
void add_prior(const AssignmentProblem& problem, const Prior& prior, const Rigid3& pose,
               NormalEquations& n) {
  const PriorRows rows = prior.rows(problem.from_world(pose));
  n.information += rows.jacobian.transpose() * rows.jacobian;
  n.gradient += rows.jacobian.transpose() * rows.residuals;
  n.chi2 += rows.residuals.squaredNorm();
}

// Adds a weak prior of one radian and ten times the map's size, which keeps the information matrix
// positive definite.
Matrix6 with_floor(const AssignmentProblem& problem, const Matrix6& information) {
  Matrix6 m = information;
  const double spread = 10 * problem.size_m;
  m.diagonal().head<3>().array() += 1;
  m.diagonal().tail<3>().array() += 1 / (spread * spread);
  return m;
}

// Inverts by 3x3 blocks (Schur complement), several times faster than a general inverse.
Matrix6 invert(const AssignmentProblem& problem, const Matrix6& information) {
  const Matrix6 m = with_floor(problem, information);
  const Eigen::Matrix3d mixed = m.topRightCorner<3, 3>();
  const Eigen::Matrix3d translation = m.bottomRightCorner<3, 3>().inverse();
  const Eigen::Matrix3d gain = mixed * translation;
  const Eigen::Matrix3d rest = m.topLeftCorner<3, 3>() - gain * mixed.transpose();
  const Eigen::Matrix3d rotation = rest.inverse();
  const Eigen::Matrix3d crossed = -rotation * gain;
  Matrix6 inverse;
  inverse << rotation, crossed, crossed.transpose(), translation - gain.transpose() * crossed;
  return inverse;
}

// Levenberg-Marquardt method; equations_at(pose) returns the normal equations.
template <typename EquationsAt>
FittedPose fit(const AssignmentProblem& problem, const Rigid3& start,
               const EquationsAt& equations_at) {
  constexpr int max_steps = 20;
  constexpr double negligible = 1e-4;  // squared length of the last step [sigma^2]
  FittedPose best;
  best.pose = start;
  NormalEquations n = equations_at(start);
  core::LevenbergMarquardt damping;
  for (int i = 0; i < max_steps; ++i) {
    Matrix6 damped = with_floor(problem, n.information);
    damped.diagonal() *= 1 + damping.lambda();
    const Vector6 step = -core::solve_llt(damped, n.gradient);
    const Rigid3 moved = perturb(best.pose, step);
    const NormalEquations after = equations_at(moved);
    if (after.chi2 <= n.chi2) {
      best.pose = moved;
      n = after;
      damping.accept();
      if (step.dot(n.information * step) < negligible) break;
    } else if (step.dot(n.information * step) < negligible) {
      break;
    } else {
      damping.reject();
    }
  }
  best.chi2 = n.chi2;
  best.covariance = invert(problem, n.information);
  return best;
}

}  // namespace

bool compare(const BearingObservation& observation, const MapPoint& map_point,
             const Eigen::Matrix3d& rotation, const Eigen::Vector3d& point_in_cam,
             Mismatch& mismatch) {
  const Eigen::Vector3d point = point_in_cam - observation.origin;
  const double depth = observation.bearing.dot(point), along = observation.axis.dot(point);
  if (!(along > 0) || !(depth > 0)) return false;
  mismatch.error = observation.tangent * point / depth;
  mismatch.by_point =
      (observation.tangent - mismatch.error * observation.bearing.transpose()) / depth;
  mismatch.covariance = observation.covariance;
  if (map_point.radius_m > 0 && !observation.of_centre) {
    // The centre of the image ellipse has the direction C + (r^2 / C_z) (n_z n - e_z), not C.
    const Eigen::Vector3d normal = rotation * map_point.normal;
    const Eigen::Vector3d shift = (observation.axis.dot(normal) * normal - observation.axis) *
                                  (map_point.radius_m * map_point.radius_m / along);
    mismatch.covariance.diagonal().array() +=
        (observation.tangent * shift).squaredNorm() / (depth * depth);
  }
  return true;
}

FittedPose assess_pose(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                       const Rigid3& pose) {
  const NormalEquations n = normal_equations(problem, pairs, pose);
  return {pose, invert(problem, n.information), n.chi2};
}

FittedPose fit_pose(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                    const Rigid3& start) {
  return fit(problem, start,
             [&](const Rigid3& pose) { return normal_equations(problem, pairs, pose); });
}

FittedPose fit_pose_with_prior(const AssignmentProblem& problem, const std::vector<Pair>& pairs,
                               const Rigid3& start) {
  const std::optional<Prior>& prior = problem.options->prior;
  if (!prior || prior->empty()) return fit_pose(problem, pairs, start);
  return fit(problem, start, [&](const Rigid3& pose) {
    NormalEquations n = normal_equations(problem, pairs, pose);
    add_prior(problem, *prior, pose, n);
    return n;
  });
}

}  // namespace occ::internal::identify
