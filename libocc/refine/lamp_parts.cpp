// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/lamp_parts.hpp"

#include "libocc/geometry/so3.hpp"

namespace occ::internal::refine {
namespace {

/// True if an observation of a lamp depends on the unknown.
bool is_used(const NormalParts& parts, int unknown) {
  for (const LampPart& part : parts.lamps)
    if (part.information(unknown, unknown) != 0) return true;
  return false;
}

/// Indices of the unknowns of the model among pose, growth and log_factor.
std::vector<int> used_unknowns(const NormalParts& parts) {
  std::vector<int> used = {0, 1, 2, 3, 4, 5};
  for (const int unknown : {growth_index, log_factor_index})
    if (is_used(parts, unknown)) used.push_back(unknown);
  return used;
}

}  // namespace

PartRecorder::PartRecorder(const PoseNormalEquations& normal, const SharedSums* shared)
    : information_(normal.information), gradient_(normal.gradient) {
  if (shared) shared_ = *shared;
}

void PartRecorder::finish(const PoseNormalEquations& normal, const SharedSums* shared,
                          LampPart& part) const {
  part.information = normal.information - information_;
  part.gradient = normal.gradient - gradient_;
  part.shared.reset();
  if (!shared) return;
  part.shared = *shared;
  part.shared->mixed -= shared_->mixed;
  part.shared->information -= shared_->information;
  part.shared->gradient -= shared_->gradient;
}

SeparationModel separation_model(const NormalParts& parts, const std::vector<int>& lamps,
                                 const Rigid3& cam_from_world, const Eigen::Vector3d& pivot,
                                 const Eigen::VectorXd& shared_errors) {
  SeparationModel model;
  if (parts.lamps.empty()) return model;
  const std::vector<int> used = used_unknowns(parts);
  const auto own = static_cast<Eigen::Index>(used.size());
  const auto& first = parts.lamps.front().shared;
  const Eigen::Index errors = first ? first->gradient.size() : 0;
  for (std::size_t i = 0; i < parts.lamps.size(); ++i) {
    const LampPart& part = parts.lamps[i];
    if (part.information.isZero(0)) continue;
    LampEquations lamp{lamps[i], Eigen::MatrixXd(own + errors, own + errors),
                       Eigen::VectorXd(own + errors)};
    lamp.information.topLeftCorner(own, own) = part.information(used, used);
    lamp.gradient.head(own) = part.gradient(used);
    if (part.shared) {
      lamp.information.topRightCorner(own, errors) = part.shared->mixed(used, Eigen::all);
      lamp.information.bottomLeftCorner(errors, own) =
          lamp.information.topRightCorner(own, errors).transpose();
      lamp.information.bottomRightCorner(errors, errors) = part.shared->information;
      lamp.gradient.tail(errors) = part.shared->gradient;
      lamp.gradient += lamp.information.rightCols(errors) * shared_errors;
    }
    model.lamps.push_back(std::move(lamp));
  }
  model.prior_information = Eigen::MatrixXd::Identity(own + errors, own + errors);
  model.prior_information.topLeftCorner(own, own) = parts.prior(used, used);
  // The position C = -R^T t moves by -R^T of the translation of a left perturbation.
  model.position_jacobian = Eigen::MatrixXd::Zero(3, own + errors);
  model.position_jacobian.leftCols<3>() = -cam_from_world.rotation.transpose() * skew(pivot);
  model.position_jacobian.middleCols<3>(3) = -cam_from_world.rotation.transpose();
  return model;
}

}  // namespace occ::internal::refine
