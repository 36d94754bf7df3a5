// SPDX-License-Identifier: Apache-2.0
// Clock, axes and gyroscope bias of an inertial measurement unit that moves with the camera, from
// the turns between pictures: step 1 of inertial_scale.hpp. The clock with the least residuals
// (Wahba's problem for each) starts a Gauss-Newton iteration; turns that contradict the others are
// left out.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "libocc/geometry/motion_input.hpp"
#include "libocc/survey/internal/inertial_scale.hpp"

namespace occ::internal::survey {

constexpr std::size_t min_inertial_poses = 10;

/// Sample at a time between two others, by linear interpolation.
ImuSample sample_between(const ImuSample& a, const ImuSample& b, double time_s);

/// Index of the last sample that is not after a time, and is not the last of all.
std::size_t sample_before(const std::vector<ImuSample>& imu, double time_s);

/// Pictures and samples, which must outlive it.
class InertialMotion {
 public:
  InertialMotion(const std::vector<TimedPose>& poses, const std::vector<ImuSample>& imu);

  std::size_t pairs() const { return turns_.size(); }
  /// Turn of the camera from picture i to the next, as a rotation vector in the frame of picture i.
  const Eigen::Vector3d& turn(std::size_t i) const { return turns_[i]; }
  double duration_s(std::size_t i) const { return poses_[i + 1].time_s - poses_[i].time_s; }
  const std::vector<TimedPose>& poses() const { return poses_; }
  const std::vector<ImuSample>& imu() const { return imu_; }
  /// True if the samples cover the time from picture i to the next without a gap.
  bool is_covered(std::size_t i, double offset_s) const;
  /// Number of such pairs.
  int covered(double offset_s) const;

 private:
  const std::vector<TimedPose>& poses_;
  const std::vector<ImuSample>& imu_;
  std::vector<Eigen::Vector3d> turns_;
  std::vector<std::pair<double, double>> gaps_;
};

/// Time and axes of the unit, and the bias of its gyroscope: [axes, bias, offset] is the order of
/// the covariance; the axes change as R_ci exp(error).
struct InertialAxes {
  Eigen::Matrix3d cam_from_imu = Eigen::Matrix3d::Identity();
  Eigen::Vector3d bias_rad_s = Eigen::Vector3d::Zero();
  double offset_s = 0;
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  std::vector<bool> used;                   // pairs of pictures
  std::vector<std::size_t> contradictions;  // pairs whose turns contradict the others
  double turn_rms_rad = 0;                  // of the camera
  double residual_sigma_rad = 0;            // per axis
  double turn_noise_rad_sqrt_s = 0;         // of the gyroscope, from the residuals
};

/// Axes with the least residuals; nothing if no clock gives enough pairs with samples.
std::optional<InertialAxes> inertial_axes(const InertialMotion& motion);

}  // namespace occ::internal::survey
