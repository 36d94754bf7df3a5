// SPDX-License-Identifier: Apache-2.0
// Where a body is in space, from images, odometry and an inertial measurement unit: an error-state
// extended Kalman filter over SE(3). State: body_from_world, its velocity, biases of gyroscope and
// accelerometer; errors are left perturbations (geometry/rigid.hpp).
//
// Between images the pose moves by odometry where there is any, its turns by the gyroscope where
// there is one; without odometry by gyroscope and accelerometer, whose bias and gravity the images
// tell apart; without either at constant velocity under white acceleration. Images come as
// PoseObservation, of any number of cameras. Measurements may arrive late and in any order within
// `history_s`: the result is that of the right order.
//
// Source: Sola, "Quaternion kinematics for the error-state Kalman filter", arXiv:1711.02508, sec.
// 5 and 7 (errors on the left here); Bar-Shalom, Li, Kirubarajan 2001, eq (6.2.2-12).
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/pose_observation.hpp"
#include "libocc/track/filter_update.hpp"
#include "libocc/track/pose_prediction.hpp"

namespace occ {

struct LIBOCC_API PoseFilterOptions {
  /// White acceleration where no odometry or accelerometer tells [m/s^2/sqrt(Hz),
  /// rad/s^2/sqrt(Hz)]: held by a person who walks.
  double acceleration_noise = 0.6, turn_acceleration_noise = 1;
  double gyro_noise = 2e-3;               ///< [rad/s/sqrt(Hz)]
  double gyro_bias_sigma = 0.02;          ///< at the start [rad/s]
  double gyro_bias_walk = 1e-4;           ///< [rad/s^2/sqrt(Hz)]
  double accelerometer_noise = 0.02;      ///< [m/s^2/sqrt(Hz)]
  double accelerometer_bias_sigma = 0.1;  ///< at the start [m/s^2]
  double accelerometer_bias_walk = 1e-3;  ///< [m/s^3/sqrt(Hz)]
  /// False: samples tell turns only.
  bool use_accelerometer = true;
  Eigen::Vector3d gravity_m_s2 = {0, 0, -9.80665};
  double imu_hold_s = 0.05;  ///< how long a sample is held when no other follows
  double start_speed_sigma_m_s = 1, start_turn_sigma_rad_s = 1;  ///< what it may do at the start
  double gate_sigma = 5;  ///< an image contradicts the prediction when chance explains it as seldom
                          ///< as so many sigmas; infinity: never
  double history_s = 2;   ///< measurements may be so late

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// The prediction with what only inertial sensors need.
struct PoseEstimate : PosePrediction {
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d accelerometer_bias_m_s2 = Eigen::Vector3d::Zero();
};

class LIBOCC_API PoseFilter {
 public:
  explicit PoseFilter(const PoseFilterOptions& options = {});
  PoseFilter(PoseFilter&&) noexcept;
  PoseFilter& operator=(PoseFilter&&) noexcept;
  ~PoseFilter();

  /// Begins, or begins anew: nothing from before is remembered. Throws std::invalid_argument for
  /// what is not finite, or a covariance that is not positive definite.
  void start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance);
  bool started() const;

  /// These throw std::invalid_argument for what is not finite, times that do not increase, and
  /// covariances with a negative variance.
  FilterUpdate add(const Odometry& step);
  FilterUpdate add(const ImuSample& sample);
  FilterUpdate add(const PoseObservation& seen);

  /// Predicted to a time; nothing before the start, or of a time that is forgotten.
  std::optional<PoseEstimate> at(double time_s) const;
  std::optional<PosePrediction> predict(double time_s) const { return at(time_s); }

  const PoseFilterOptions& options() const;

 private:
  class Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace occ
