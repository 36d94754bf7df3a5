// SPDX-License-Identifier: Apache-2.0
// Peer of the refinement of image points: a hand-written Levenberg-Marquardt for a pinhole without
// distortion, with 6x6 normal equations solved by Cholesky decomposition.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "libocc/geometry/rigid.hpp"

namespace occ::bench {

struct PinholePoints {
  double fx, fy, cx, cy;
  const std::vector<Eigen::Vector3d>& world;
  const std::vector<Eigen::Vector2d>& px;
};

/// Returns the sum of squares and, on request, the normal equations.
inline double squares(const PinholePoints& problem, const Rigid3& pose, Matrix6* information,
                      Vector6* gradient) {
  double sum = 0;
  if (information) information->setZero();
  if (gradient) gradient->setZero();
  for (std::size_t i = 0; i < problem.world.size(); ++i) {
    const Eigen::Vector3d p = pose * problem.world[i];
    const double inverse_z = 1 / p.z(), x = p.x() * inverse_z, y = p.y() * inverse_z;
    const Eigen::Vector2d residual(problem.fx * x + problem.cx - problem.px[i].x(),
                                   problem.fy * y + problem.cy - problem.px[i].y());
    sum += residual.squaredNorm();
    if (!information) continue;
    Vector6 u, v;
    u << -x * y, 1 + x * x, -y, inverse_z, 0, -x * inverse_z;
    v << -1 - y * y, x * y, x, 0, inverse_z, -y * inverse_z;
    u *= problem.fx;
    v *= problem.fy;
    information->noalias() += u * u.transpose() + v * v.transpose();
    *gradient += residual.x() * u + residual.y() * v;
  }
  return sum;
}

inline Rigid3 levenberg_marquardt(const PinholePoints& problem, Rigid3 pose, int max_iterations) {
  double damping = 1e-6;
  Matrix6 information;
  Vector6 gradient;
  double cost = squares(problem, pose, &information, &gradient);
  for (int i = 0; i < max_iterations; ++i) {
    Matrix6 damped = information;
    damped.diagonal() *= 1 + damping;
    const Vector6 step = -Eigen::LLT<Matrix6>(damped).solve(gradient);
    const Rigid3 next = perturb(pose, step);
    const double next_cost = squares(problem, next, nullptr, nullptr);
    if (next_cost > cost) {
      damping *= 10;
      if (damping > 1e6) break;
      continue;
    }
    const bool converged = cost - next_cost < 1e-10 * cost || step.squaredNorm() < 1e-22;
    pose = next;
    if (converged) break;
    damping = std::max(1e-12, damping / 10);
    cost = squares(problem, pose, &information, &gradient);
  }
  return pose;
}

}  // namespace occ::bench
