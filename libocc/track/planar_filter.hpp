// SPDX-License-Identifier: Apache-2.0
// Where a vehicle on a floor is, from images, wheel odometry and a gyroscope: an extended Kalman
// filter over SE(2). State: pose, velocity, the gyroscope's bias.
//
// Between images the pose moves by odometry where there is any, its turns by the gyroscope where
// there is one, else at constant velocity under white acceleration. Images come as PoseObservation;
// of height, roll and pitch the floor allows what the options say, anew in every image.
// Measurements may arrive late and in any order within `history_s`: the result is that of the right
// order.
//
// Source: Thrun, Burgard, Fox, Probabilistic Robotics, 2005, sec. 3.3 and 7.4; delayed measurements
// by doing again what came after them.
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

struct LIBOCC_API PlanarFilterOptions {
  double height_m = 0;           ///< of the body's origin above the world's z = 0
  double height_sigma_m = 1e-3;  ///< of the floor under the vehicle, from image to image
  double tilt_sigma_rad = 1e-3;  ///< of roll and of pitch, alike
  /// White acceleration where there is no odometry [m/s^2/sqrt(Hz), rad/s^2/sqrt(Hz)].
  double acceleration_noise = 0.5, lateral_noise = 0.1, turn_acceleration_noise = 1;
  double gyro_noise = 2e-3;       ///< [rad/s/sqrt(Hz)]
  double gyro_bias_sigma = 0.02;  ///< at the start [rad/s]
  double gyro_bias_walk = 1e-4;   ///< [rad/s^2/sqrt(Hz)]
  double imu_hold_s = 0.05;       ///< how long a sample is held when no other follows
  double start_speed_sigma_m_s = 1, start_turn_sigma_rad_s = 1;  ///< what it may do at the start
  double gate_sigma = 5;  ///< an image contradicts the prediction when chance explains it as seldom
                          ///< as so many sigmas; infinity: never
  double history_s = 2;   ///< measurements may be so late

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

struct PlanarEstimate {
  double time_s = 0;
  PlanarPose pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< see geometry/planar_pose.hpp
  /// [forward, left, turn] of the body [m/s, m/s, rad/s].
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();
  double gyro_bias_rad_s = 0;
};

class LIBOCC_API PlanarFilter {
 public:
  explicit PlanarFilter(const PlanarFilterOptions& options = {});
  PlanarFilter(PlanarFilter&&) noexcept;
  PlanarFilter& operator=(PlanarFilter&&) noexcept;
  ~PlanarFilter();

  /// Begins, or begins anew: nothing from before is remembered. Throws std::invalid_argument for
  /// what is not finite, or a covariance that is not positive definite.
  void start(double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance);
  bool started() const;

  /// These throw std::invalid_argument for what is not finite, times that do not increase, and
  /// covariances with a negative variance.
  FilterUpdate add(const PlanarOdometry& step);
  FilterUpdate add(const ImuSample& sample);  ///< its turn rate about z
  FilterUpdate add(const PoseObservation& seen);

  /// Predicted to a time; nothing before the start, or of a time that is forgotten.
  std::optional<PlanarEstimate> at(double time_s) const;

  /// The same as a pose in space, height and tilt as uncertain as the floor.
  std::optional<PosePrediction> predict(double time_s) const;

  const PlanarFilterOptions& options() const;

 private:
  class Memory;
  std::unique_ptr<Memory> memory_;
};

}  // namespace occ
