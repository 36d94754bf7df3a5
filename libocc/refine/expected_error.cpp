// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/expected_error.hpp"

#include <Eigen/LU>
#include <cmath>
#include <optional>

#include "libocc/formation/rim.hpp"
#include "libocc/geometry/internal/derivative_by_pose.hpp"

namespace occ::internal::refine {

ExpectedError expected_error(const Rigid3& cam_from_world, const Matrix6& covariance,
                             const Vector6& bias) {
  const double position_m2 = position_covariance(cam_from_world, covariance).trace();
  return {std::sqrt(position_m2 + bias.tail<3>().squaredNorm()),
          std::sqrt(covariance.topLeftCorner<3, 3>().trace() + bias.head<3>().squaredNorm())};
}

Vector6 bias_of_points(const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                       const Scene& scene, const Rigid3& cam_from_world, const Matrix6& covariance,
                       double model_sigma_px) {
  Vector6 gradient = Vector6::Zero();
  for (const Match& match : matches) {
    const Lamp& lamp = scene.lamps[match.lamp];
    const Blob& blob = blobs[match.blob];
    if (blob.cut_by_border) continue;  // no centroid of the whole lamp
    const Eigen::Vector3d point = cam_from_world * lamp.centre_m;
    Eigen::Matrix<double, 2, 3> d_point;
    const std::optional<Eigen::Vector2d> centre = scene.camera.project(point, &d_point);
    const std::optional<Eigen::Vector2d> seen =
        project_lamp_centre(lamp, cam_from_world, scene.camera);
    if (!centre || !seen) continue;
    const Eigen::Matrix<double, 2, 6> d_pose = geometry::derivative_by_pose(d_point, point);
    const Eigen::Matrix2d covariance_px2 =
        blob.covariance_px2 + model_sigma_px * model_sigma_px * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d off_px = scene.camera.difference_px(*seen, *centre);
    gradient += d_pose.transpose() * covariance_px2.inverse() * off_px;
  }
  return covariance * gradient;
}

}  // namespace occ::internal::refine
