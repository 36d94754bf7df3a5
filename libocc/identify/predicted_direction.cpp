// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/predicted_direction.hpp"

#include <cmath>

namespace occ::internal::identify {
namespace {

double max_variance(const Eigen::Matrix2d& m) {
  const double mean = 0.5 * m.trace(), half = 0.5 * (m(0, 0) - m(1, 1));
  return mean + std::hypot(half, m(0, 1));
}

}  // namespace

double direction_variance(const AssignmentProblem& problem, int observation) {
  const BearingObservation& s = problem.observation(observation);
  return max_variance(s.covariance) + s.parallax_rad * s.parallax_rad;
}

CommonRotation::CommonRotation(const AssignmentProblem& problem,
                               const std::array<int, 3>& observations) {
  for (const int s : observations) {
    middle_ += problem.observation(s).bearing / 3;
    mean2_ += direction_variance(problem, s) / 3;
  }
  for (const int s : observations)
    spread2_ += (problem.observation(s).bearing - middle_).squaredNorm();
}

double CommonRotation::operator()(const Eigen::Vector3d& bearing) const {
  return mean2_ * (1.0 / 3 + (bearing - middle_).squaredNorm() / spread2_);
}

UprightPrediction::UprightPrediction(const AssignmentProblem& problem,
                                     const std::array<int, 2>& observations) {
  const Eigen::Vector3d &f0 = problem.observation(observations[0]).bearing,
                        &f1 = problem.observation(observations[1]).bearing;
  middle_ = 0.5 * (f0 + f1);
  mean2_ = 0.5 * (direction_variance(problem, observations[0]) +
                  direction_variance(problem, observations[1]));
  apart2_ = (f0 - f1).squaredNorm();
  gravity2_ = std::pow(problem.options->prior->gravity_sigma_rad, 2);
}

double UprightPrediction::operator()(const Eigen::Vector3d& bearing) const {
  const double away2 = (bearing - middle_).squaredNorm();
  return mean2_ * (0.5 + 4 * away2 / apart2_) + 2 * gravity2_ * away2;
}

}  // namespace occ::internal::identify
