// SPDX-License-Identifier: Apache-2.0
#include "libocc/position/internal/motion_filter.hpp"

namespace occ {
namespace {

/// [x, y, heading] of an upright body by the left perturbation of body_from_world.
Eigen::Matrix3d planar_covariance(const Rigid3& body_from_world, const Matrix6& covariance) {
  Eigen::Matrix<double, 3, 6> d = Eigen::Matrix<double, 3, 6>::Zero();
  d.block<2, 3>(0, 3) = -body_from_world.rotation.leftCols<2>().transpose();
  d(2, 2) = -1;
  return d * covariance * d.transpose();
}

}  // namespace

bool MotionFilter::started() const {
  return std::visit([](const auto& filter) { return filter.started(); }, filter_);
}

void MotionFilter::start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance) {
  if (PoseFilter* space = in_space()) return space->start(time_s, body_from_world, covariance);
  on_floor()->start(time_s, planar_pose(body_from_world),
                    planar_covariance(body_from_world, covariance));
}

std::optional<PosePrediction> MotionFilter::predict(double time_s) const {
  return std::visit([&](const auto& filter) { return filter.predict(time_s); }, filter_);
}

double MotionFilter::gate_sigma() const {
  return std::visit([](const auto& filter) { return filter.options().gate_sigma; }, filter_);
}

}  // namespace occ
