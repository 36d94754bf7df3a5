// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/outline_misfit.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/search_by_outline.hpp"

namespace occ::internal::identify {

OutlineMisfit::OutlineMisfit(const AssignmentProblem& problem) : problem_(problem) {
  if (!problem.scene || !problem.camera->is_central()) return;
  const std::vector<Lamp>& lamps = problem.scene->lamps;
  const auto is_round = [](const Lamp& lamp) {
    return lamp.shape == LampShape::point || lamp.shape == LampShape::disc;
  };
  if (std::all_of(lamps.begin(), lamps.end(), is_round)) return;
  for (const Lamp& lamp : lamps)
    moments_m2_.push_back(is_round(lamp) ? Eigen::Matrix2d(Eigen::Matrix2d::Zero())
                                         : face_moments_m2(lamp));
}

double OutlineMisfit::of(const PoseHypothesis& hypothesis) const {
  double sum = 0;
  if (moments_m2_.empty()) return sum;
  for (const Pair& pair : hypothesis.pairs) sum += of(pair, hypothesis.estimate.pose);
  return sum;
}

double OutlineMisfit::of(const Pair& pair, const Rigid3& pose) const {
  constexpr double max_chi2 = 9, relative = 0.1, error_px = 0.7, growth_px = 3;
  const auto index = static_cast<std::size_t>(pair.map_point);
  const Eigen::Matrix2d& face = moments_m2_[index];
  const Blob& blob =
      (*problem_.blobs)[static_cast<std::size_t>(problem_.observation(pair.observation).blob)];
  if (blob.rim.empty() || blob.merged || blob.cut_by_border || blob.striped ||
      blob.has_hidden_sides() || !(blob.ellipse.semi_minor_px > 0) || !(face.trace() > 0))
    return 0;
  const Lamp& lamp = problem_.scene->lamps[index];
  const Eigen::Vector3d centre = pose * problem_.map_point(pair.map_point).centre;
  Eigen::Matrix<double, 3, 2> axes;  // of the lamp, in the camera's frame
  axes << pose.rotation * lamp.x_axis, pose.rotation * lamp.normal.cross(lamp.x_axis);
  Eigen::Matrix<double, 2, 3> px_by_point;
  if (!problem_.camera->project(centre, &px_by_point)) return 0;
  const Eigen::Matrix2d by_face = px_by_point * axes;
  const Eigen::Matrix2d predicted_px2 = by_face * face * by_face.transpose();
  const Eigen::Rotation2Dd turn(blob.ellipse.angle_rad);
  const Eigen::Vector2d half(blob.ellipse.semi_major_px / 2, blob.ellipse.semi_minor_px / 2);
  const Eigen::Matrix2d root = turn.toRotationMatrix() * half.asDiagonal();
  const Eigen::Matrix2d measured_px2 = root * root.transpose();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix2d> ratios(measured_px2,
                                                                         predicted_px2);
  if (ratios.info() != Eigen::Success || !(ratios.eigenvalues()[0] > 0)) return max_chi2;
  const double sigma = std::hypot(
      relative, (error_px + (blob.saturated ? growth_px : 0)) / blob.ellipse.semi_minor_px);
  return std::min(max_chi2, (0.5 * ratios.eigenvalues().array().log() / sigma).square().sum());
}

}  // namespace occ::internal::identify
