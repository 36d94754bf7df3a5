// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/internal/integrity_monitor.hpp"

#include <cmath>

#include "libocc/core/internal/dense.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::track {
namespace {

/// The risk is divided among position, heading and odometry.
constexpr double parts = 3;

/// The model with the body's position in the rows x and y, and its heading in the third one.
SeparationModel body_model(const SingleImage& image) {
  SeparationModel model = image.refined.separation;
  const Eigen::Matrix3d world_from_cam = image.refined.cam_from_world.rotation.transpose();
  const Eigen::Matrix3d by_turn = world_from_cam * skew(image.cam_from_body.translation);
  model.position_jacobian.leftCols<3>() += by_turn;
  model.position_jacobian.row(2).setZero();
  model.position_jacobian.row(2).head<3>() = world_from_cam.row(2);
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose << by_turn, -world_from_cam;
  by_pose.row(2) << world_from_cam.row(2), Eigen::RowVector3d::Zero();
  const Matrix6 covariance = image.refined.covariance + image.mount_covariance;
  model.position_covariance_m2 = by_pose * covariance * by_pose.transpose();
  return model;
}

}  // namespace

IntegrityMonitor::IntegrityMonitor(const TrackerOptions& options) : options_(options) {
  if (is_on() && options.floor) odometry_.emplace(*options.floor);
}

void IntegrityMonitor::clear() { bound_.reset(); }

std::string IntegrityMonitor::add(const SingleImage& image, const Eigen::Vector2d& tracked_m) {
  constexpr double exact = 1e-18;
  SeparationModel model = body_model(image);
  model.fault_probability = options_.locate.lamp_fault_probability;
  const Result<ProtectionLevel> level = protection_level(model, options_.integrity_risk / parts);
  if (level.status == Status::no_pose) return level.message;
  if (!level.ok()) return {};
  const PlanarPose pose = planar_pose(image.cam_from_body.inverse() * image.refined.cam_from_world);
  const double from_tracked_m = (tracked_m - pose.position()).norm();
  if (from_tracked_m + level->horizontal_m > level_m(tracked_m, image.time_s)) return {};
  bound_ = {image.time_s, pose.position(), level->horizontal_m, level->vertical_m};
  if (odometry_) odometry_->start(image.time_s, pose, exact * Eigen::Matrix3d::Identity());
  return {};
}

double IntegrityMonitor::level_m(const Eigen::Vector2d& tracked_m, double time_s) const {
  if (!bound_ || time_s < bound_->time_s) return infinity;
  if (time_s == bound_->time_s) return bound_->level_m + (tracked_m - bound_->position_m).norm();
  const std::optional<PlanarEstimate> moved = odometry_ ? odometry_->at(time_s) : std::nullopt;
  if (!moved) return infinity;
  const Eigen::Matrix2d covariance = moved->covariance.topLeftCorner<2, 2>();
  const double sigma_m = std::sqrt(core::symmetric_eigenvalues(covariance)[1]);
  const double sigmas = std::sqrt(-2 * std::log(options_.integrity_risk / parts));
  const Eigen::Vector2d reckoned_m = moved->pose.position();
  return (tracked_m - reckoned_m).norm() + bound_->level_m +
         bound_->heading_level_rad * (reckoned_m - bound_->position_m).norm() + sigmas * sigma_m;
}

}  // namespace occ::internal::track
