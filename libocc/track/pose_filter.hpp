// SPDX-License-Identifier: Apache-2.0
// Error-state extended Kalman filter over SE(3) for a body in space, with images, odometry and an
// inertial measurement unit. State: body_from_world, its velocity, biases of gyroscope and
// accelerometer. Errors are left perturbations (geometry/rigid.hpp).
//
// Motion model between images: odometry if there is any; the gyroscope replaces its rotation.
// Without odometry the gyroscope and the accelerometer move the pose; images separate the
// accelerometer's bias from gravity. Without either the velocity is constant under white
// acceleration. Images of any number of cameras enter as PoseObservation. Measurements may arrive
// late and in any order within `history_s`: later measurements are processed again, so the result
// is that of the right order.
//
// Source: Sola, "Quaternion kinematics for the error-state Kalman filter", arXiv:1711.02508, sec.
// 5 and 7 (errors on the left here); Bar-Shalom, Li, Kirubarajan 2001, eq (6.2.2-12). The
// covariance is kept in square-root form (Bierman, Factorization Methods for Discrete Sequential
// Estimation, 1977), so it stays positive definite after gaps of any length.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/pose_observation.hpp"
#include "libocc/track/filter_update.hpp"

namespace occ {

/// Options of a PoseFilter.
struct LIBOCC_API PoseFilterOptions {
  /// Process noise: root spectral density of the acceleration without odometry and inertial sensors
  /// [m/s^2/sqrt(Hz), rad/s^2/sqrt(Hz)]. Within one second the velocity changes by 0.6 m/s and the
  /// rotation rate by 1 rad/s (1 sigma), as for a camera in the hand of a person who walks.
  double acceleration_noise = 0.6, turn_acceleration_noise = 1;
  double gyro_noise = 2e-3;               ///< [rad/s/sqrt(Hz)]
  double gyro_bias_sigma = 0.02;          ///< standard deviation of the initial bias [rad/s]
  double gyro_bias_walk = 1e-4;           ///< random walk of the bias [rad/s^2/sqrt(Hz)]
  double accelerometer_noise = 0.02;      ///< [m/s^2/sqrt(Hz)]
  double accelerometer_bias_sigma = 0.1;  ///< standard deviation of the initial bias [m/s^2]
  double accelerometer_bias_walk = 1e-3;  ///< random walk of the bias [m/s^3/sqrt(Hz)]
  bool use_accelerometer = true;          ///< false: only the rotation rates of samples are used
  Eigen::Vector3d gravity_m_s2 = {0, 0, -9.80665};  ///< acceleration of free fall in the world
  double imu_hold_s = 0.05;  ///< time for which a sample is used if no other follows
  /// Standard deviations of the initial velocity, which is zero.
  double start_speed_sigma_m_s = 1, start_turn_sigma_rad_s = 1;
  double gate_sigma = 5;  ///< gate for the NIS of an image, as the sigmas of a normal variable with
                          ///< the same tail probability; infinity accepts every image
  double history_s = 2;   ///< maximum delay of a measurement

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// A prediction with the biases of the inertial sensors.
struct PoseEstimate : PosePrediction {
  Eigen::Vector3d gyro_bias_rad_s = Eigen::Vector3d::Zero();          ///< along the body's axes
  Eigen::Vector3d accelerometer_bias_m_s2 = Eigen::Vector3d::Zero();  ///< along the body's axes
};

/// Filter for a body that moves in space.
class LIBOCC_API PoseFilter {
 public:
  /// Throws std::invalid_argument for invalid options.
  explicit PoseFilter(const PoseFilterOptions& options = {});
  PoseFilter(PoseFilter&&) noexcept;
  PoseFilter& operator=(PoseFilter&&) noexcept;
  ~PoseFilter();

  /// Starts or restarts the filter; all earlier measurements are dropped. Throws
  /// std::invalid_argument for values that are not finite and for a covariance that is not
  /// symmetric and positive definite.
  void start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance);
  /// True after start().
  bool started() const;

  /// Add a measurement. They throw std::invalid_argument for values that are not finite, times that
  /// do not increase, and a covariance or information that is not symmetric and positive
  /// semi-definite.
  FilterUpdate add(const Odometry& step);
  /// Uses rotation rate and acceleration of a sample.
  FilterUpdate add(const ImuSample& sample);
  /// Adds an image; the gate applies to its NIS.
  FilterUpdate add(const PoseObservation& seen);

  /// Returns the estimate predicted to a time; nullopt before the start and before the history.
  std::optional<PoseEstimate> at(double time_s) const;
  /// Returns the pose of at() without the biases.
  std::optional<PosePrediction> predict(double time_s) const { return at(time_s); }

  /// Options as given to the constructor.
  const PoseFilterOptions& options() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace occ
