// SPDX-License-Identifier: Apache-2.0
// Errors of the directions in which a pose from two or three bearings predicts further lamps, to
// first order. They determine the gates of voting.
#pragma once

#include <array>

#include "libocc/identify/internal/assignment_problem.hpp"

namespace occ::internal::identify {

/// Largest variance of the direction of an observation [rad^2].
double direction_variance(const AssignmentProblem& problem, int observation);

/// Variance of the common rotation of three measured bearings, evaluated at a fourth bearing.
class CommonRotation {
 public:
  CommonRotation(const AssignmentProblem& problem, const std::array<int, 3>& observations);
  double operator()(const Eigen::Vector3d& bearing) const;  ///< [rad^2]

 private:
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  double mean2_ = 0, spread2_ = 0;
};

/// Variance of the direction that a pose from two bearings and gravity predicts, evaluated at a
/// third bearing. The pose turns and scales with the errors of the two bearings, and tilts by the
/// error of gravity.
class UprightPrediction {
 public:
  UprightPrediction(const AssignmentProblem& problem, const std::array<int, 2>& observations);
  double operator()(const Eigen::Vector3d& bearing) const;  ///< [rad^2]

 private:
  Eigen::Vector3d middle_;
  double mean2_ = 0, apart2_ = 0, gravity2_ = 0;
};

}  // namespace occ::internal::identify
