// SPDX-License-Identifier: Apache-2.0
// Results of the filters: the outcome of one measurement, and a predicted pose.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/geometry/unknown_covariance.hpp"

namespace occ {

/// Use of a measurement.
enum class FilterOutcome {
  accepted,     ///< the measurement corrected the filter
  gated,        ///< rejected: contradicts the prediction
  too_old,      ///< rejected: older than the filter's history
  overlapping,  ///< rejected: earlier odometry covers part of its time
  not_started,  ///< ignored: the filter has no pose yet
};

/// Result of adding one measurement.
struct FilterUpdate {
  /// Accepted, or the reason for the rejection.
  FilterOutcome outcome = FilterOutcome::not_started;
  double nis = 0;   ///< normalised innovation squared; chi-square with nis_dof for right models
  int nis_dof = 0;  ///< number of directions of the pose that the measurement determines

  /// True if the measurement was used.
  bool accepted() const { return outcome == FilterOutcome::accepted; }
};

/// Pose and velocity of a body, predicted to a time.
struct PosePrediction {
  double time_s = 0;                                      ///< time of the prediction
  Rigid3 body_from_world;                                 ///< predicted pose
  Matrix6 covariance = unknown_covariance<6>();           ///< see geometry/rigid.hpp
  Vector6 velocity = Vector6::Zero();                     ///< see geometry/motion.hpp
  Matrix6 velocity_covariance = unknown_covariance<6>();  ///< order as `velocity`
  /// Systematic errors that the pose depends on, see PoseObservation, and the derivative of its
  /// error by them. Their part of the covariance is by_systematic * by_systematic^T.
  std::vector<int> systematic = {};
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_systematic = {};  ///< one column for each
};

}  // namespace occ
