// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/prior_gate.hpp"

#include <Eigen/Geometry>
#include <cmath>

#include "libocc/geometry/so3.hpp"

namespace occ::internal::identify {
namespace {

bool within(double off, double variance) { return off * off <= max_prior_chi2 * variance; }

}  // namespace

Eigen::Matrix3d cam_from_upright(const AssignmentProblem& problem) {
  return shortest_rotation(-Eigen::Vector3d::UnitZ(),
                           problem.options->prior->gravity_in_cam->normalized());
}

PriorGate::PriorGate(const AssignmentProblem& problem, const Eigen::Matrix3d& cam_from_upright)
    : right_(cam_from_upright.row(0).head<2>()) {
  const Prior& prior = *problem.options->prior;
  if (prior.position_m)
    position_ = Around{*prior.position_m - problem.origin, prior.position_sigmas().cwiseAbs2()};
  if (prior.height_m) height_ = *prior.height_m - problem.origin.z();
  height_variance_ = prior.height_sigma_m * prior.height_sigma_m;
  if (prior.heading_rad)
    heading_ = Eigen::Vector2d(std::cos(*prior.heading_rad), std::sin(*prior.heading_rad));
  heading_variance_ = prior.heading_sigma_rad * prior.heading_sigma_rad;
  if (!prior.last_pose) return;
  const Rigid3& last = prior.last_pose->cam_from_world;
  last_ = Around{last.origin_in_source() - problem.origin,
                 position_covariance(last, prior.last_pose->covariance).diagonal()};
}

bool PriorGate::allows(const Eigen::Vector3d& position, double cosine, double sine,
                       double distance_m, double relative) const {
  const double turn2 = relative * relative, error2 = turn2 * distance_m * distance_m;
  if (height_ && !within(position.z() - *height_, height_variance_ + error2)) return false;
  for (const std::optional<Around>* around : {&position_, &last_})
    for (int i = 0; *around && i < 3; ++i)
      if (!within(position[i] - (*around)->position[i], (*around)->variances[i] + error2))
        return false;
  if (!heading_) return true;
  const Eigen::Vector2d right(cosine * right_.x() + sine * right_.y(),
                              cosine * right_.y() - sine * right_.x());
  const double reach = right.norm();
  const double max_rad =
      max_prior_sigmas * std::sqrt(heading_variance_ + turn2) / std::max(reach, 1e-6);
  return max_rad > 3.14159 || right.dot(*heading_) >= reach * std::cos(max_rad);
}

}  // namespace occ::internal::identify
