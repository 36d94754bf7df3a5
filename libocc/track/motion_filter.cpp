// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/internal/motion_filter.hpp"

#include "libocc/geometry/perturbation.hpp"

namespace occ::internal::track {
bool MotionFilter::started() const {
  return std::visit([](const auto& filter) { return filter.started(); }, filter_);
}

void MotionFilter::start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance) {
  if (PoseFilter* space = in_space()) return space->start(time_s, body_from_world, covariance);
  const PlanarPose pose = planar_pose(body_from_world);
  on_floor()->start(time_s, pose, planar_covariance(pose, covariance));
}

std::optional<PosePrediction> MotionFilter::predict(double time_s) const {
  return std::visit([&](const auto& filter) { return filter.predict(time_s); }, filter_);
}

double MotionFilter::gate_sigma() const {
  return std::visit([](const auto& filter) { return filter.options().gate_sigma; }, filter_);
}

}  // namespace occ::internal::track
