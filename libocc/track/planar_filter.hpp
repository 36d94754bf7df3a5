// SPDX-License-Identifier: Apache-2.0
// Extended Kalman filter over SE(2) for a vehicle on a floor, with images, wheel odometry and a
// gyroscope. State: pose, velocity, bias of the gyroscope.
//
// Motion model between images: odometry if there is any; the gyroscope replaces its rotation.
// Without odometry the velocity is constant under white acceleration. Images enter as
// PoseObservation. Height, roll and pitch scatter about the floor independently in each image, with
// the standard deviations of the options. Measurements may arrive late and in any order within
// `history_s`: later measurements are processed again, so the result is that of the right order.
//
// Source: Thrun, Burgard, Fox, Probabilistic Robotics, 2005, sec. 3.3 and 7.4. The covariance is
// kept in square-root form (Bierman, Factorization Methods for Discrete Sequential Estimation,
// 1977), so it stays positive definite after gaps of any length.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/motion_input.hpp"
#include "libocc/geometry/pose_observation.hpp"
#include "libocc/track/filter_update.hpp"

namespace occ {

/// Options of a PlanarFilter.
struct LIBOCC_API PlanarFilterOptions {
  double height_m = 0;  ///< height of the body's origin above the world's z = 0
  /// Standard deviations of the floor: of its height, and of roll and pitch from image to image.
  /// Default: half of the flatness limit of a usual floor, 4 mm over a metre (DIN 18202, table 3,
  /// line 3).
  double height_sigma_m = 2e-3, tilt_sigma_rad = 2e-3;
  /// Process noise: root spectral density of the acceleration without odometry, forward, sideways,
  /// about the vertical axis [m/s^2/sqrt(Hz), rad/s^2/sqrt(Hz)]. Within one second the velocity
  /// changes by 0.5 m/s forward and 0.1 m/s sideways, as of an indoor vehicle that cannot slip far.
  double acceleration_noise = 0.5, lateral_noise = 0.1, turn_acceleration_noise = 1;
  double gyro_noise = 2e-3;       ///< [rad/s/sqrt(Hz)]
  double gyro_bias_sigma = 0.02;  ///< standard deviation of the initial bias [rad/s]
  double gyro_bias_walk = 1e-4;   ///< random walk of the bias [rad/s^2/sqrt(Hz)]
  double imu_hold_s = 0.05;       ///< time for which a sample is used if no other follows
  /// Standard deviations of the initial velocity, which is zero.
  double start_speed_sigma_m_s = 1, start_turn_sigma_rad_s = 1;
  double gate_sigma = 5;  ///< gate for the NIS of an image, as the sigmas of a normal variable with
                          ///< the same tail probability; infinity accepts every image
  double history_s = 2;   ///< maximum delay of a measurement

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// State of a PlanarFilter at one time.
struct PlanarEstimate {
  double time_s = 0;                                     ///< time of the estimate
  PlanarPose pose;                                       ///< pose of the body's origin
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< see geometry/planar_pose.hpp
  /// Velocity in the body frame: forward, left, rotation [m/s, m/s, rad/s].
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();  ///< order as `velocity`
  double gyro_bias_rad_s = 0;                                     ///< about the vertical
};

/// Filter for a vehicle on a floor.
class LIBOCC_API PlanarFilter {
 public:
  /// Throws std::invalid_argument for invalid options.
  explicit PlanarFilter(const PlanarFilterOptions& options = {});
  PlanarFilter(PlanarFilter&&) noexcept;
  PlanarFilter& operator=(PlanarFilter&&) noexcept;
  ~PlanarFilter();

  /// Starts or restarts the filter; all earlier measurements are dropped. Throws
  /// std::invalid_argument for values that are not finite and for a covariance that is not
  /// symmetric and positive definite.
  void start(double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance);
  /// True after start().
  bool started() const;

  /// Add a measurement. They throw std::invalid_argument for values that are not finite, times that
  /// do not increase, and a covariance or information that is not symmetric and positive
  /// semi-definite.
  FilterUpdate add(const PlanarOdometry& step);
  FilterUpdate add(const ImuSample& sample);  ///< uses the rotation rate about z
  /// Adds an image; the gate applies to its NIS.
  FilterUpdate add(const PoseObservation& seen);

  /// Returns the estimate predicted to a time; nullopt before the start and before the history.
  std::optional<PlanarEstimate> at(double time_s) const;

  /// Like at(), as a pose in space; height and tilt have the variances of the floor.
  std::optional<PosePrediction> predict(double time_s) const;

  /// Options as given to the constructor.
  const PlanarFilterOptions& options() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace occ
