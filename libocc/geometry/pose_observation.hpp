// SPDX-License-Identifier: Apache-2.0
// Likelihood of a camera's pose from one image, to second order about a pose. Half of chi2 is
//
//   gradient . delta + 1/2 delta . information delta,   delta: left perturbation of cam_from_world
//
// up to a constant. With one or two lamps the information is singular, but still useful together
// with a prior.
//
// Systematic errors are constants that are common to several observations, such as the errors of a
// map. They do not average away. Each is an unknown with zero mean and unit variance. Half of chi2
// then also has the term  delta . gradient_by_systematic errors;  information and gradient are
// those of exact values of the errors.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"

namespace occ {

/// Information on a camera's pose at one time, as input of filters and smoothers.
struct LIBOCC_API PoseObservation {
  double time_s = 0;      ///< time at which the pose holds
  Rigid3 cam_from_world;  ///< pose about which the likelihood is expanded
  /// Second derivative of half of chi2; symmetric, positive semi-definite.
  Matrix6 information = Matrix6::Zero();
  /// First derivative of half of chi2; zero at the most likely pose.
  Vector6 gradient = Vector6::Zero();
  Rigid3 cam_from_body;  ///< mounting of the camera; constant
  /// Number of each systematic error. The same number in another observation is the same error.
  std::vector<int> systematic = {};
  /// Derivative of the gradient by the systematic errors, one column for each.
  Eigen::Matrix<double, 6, Eigen::Dynamic> gradient_by_systematic = {};
  /// Number of the last systematic errors whose derivatives vary by noise, such as those of a clock
  /// by a measured velocity. Filters do not estimate them from that variation: the gain takes their
  /// effects on different observations as independent, the covariance as common.
  int uncertain_systematic = 0;

  /// Observation from a pose with its covariance. Throws std::invalid_argument if the covariance is
  /// not symmetric and positive definite.
  static PoseObservation of_pose(double time_s, const Rigid3& cam_from_world,
                                 const Matrix6& covariance, const Rigid3& cam_from_body = {});

  /// Observation with the systematic errors eliminated, as if they were independent of those of all
  /// other observations.
  PoseObservation without_systematic() const;

  /// Equivalent observation of body_from_world, with gradient and information by its left
  /// perturbation. The systematic errors are eliminated.
  PoseObservation of_body() const;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

}  // namespace occ
