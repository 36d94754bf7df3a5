// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/scene_errors.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/geometry/so3.hpp"

namespace occ::internal::refine {

LampError LampErrors::scaled(const LampError& unit) const {
  LampError error;
  error << tilt_rad * unit.head<3>(), position_m.cwiseProduct(unit.segment<3>(3)), size * unit[6];
  return error;
}

std::optional<LampErrors> errors_of(const Lamp& lamp, const Scene& scene) {
  LampErrors errors;
  if (const auto sigma_m = scene.position_sigma_m(lamp)) errors.position_m = *sigma_m;
  errors.size = lamp.size_sigma;
  errors.tilt_rad = lamp.tilt_sigma_rad.value_or(0);
  if (errors.position_m.isZero(0) && errors.size == 0 && errors.tilt_rad == 0) return std::nullopt;
  return errors;
}

bool has_exact_map(const Scene& scene) {
  return std::none_of(scene.lamps.begin(), scene.lamps.end(),
                      [&](const Lamp& lamp) { return errors_of(lamp, scene).has_value(); });
}

LampInCam with_error(LampInCam lamp, const LampError& error, const Rigid3& cam_from_world) {
  const Eigen::Matrix3d turn = so3_exp(cam_from_world.rotation * error.head<3>());
  lamp.centre_m += cam_from_world.rotation * error.segment<3>(3);
  lamp.normal = turn * lamp.normal;
  lamp.x_axis = turn * lamp.x_axis;
  lamp.radius_m *= 1 + error[6];
  lamp.size_m *= 1 + error[6];
  return lamp;
}

Eigen::Matrix<double, 6, 7> unit_motion(const LampErrors& errors, const LampInCam& lamp,
                                        double size_error, const Rigid3& cam_from_world) {
  Eigen::Matrix<double, 6, 7> motion = Eigen::Matrix<double, 6, 7>::Zero();
  motion.topLeftCorner<3, 3>() = errors.tilt_rad * cam_from_world.rotation;
  motion.block<3, 3>(3, 3) = cam_from_world.rotation * errors.position_m.asDiagonal();
  motion.block<3, 1>(3, 6) = -errors.size / (1 + size_error) * lamp.centre_m;
  return motion;
}

CameraErrors::CameraErrors(const Camera& camera) : root_(camera.root_of_covariance()) {}

Camera CameraErrors::camera(const Camera& stated, const Eigen::VectorXd& errors) const {
  Eigen::VectorXd values = root_ * errors;
  const std::vector<CameraParameter> parameters = stated.parameters();
  for (std::size_t i = 0; i < parameters.size(); ++i)
    values[static_cast<Eigen::Index>(i)] += parameters[i].value;
  return stated.with_parameters(values);
}

Eigen::Matrix2Xd CameraErrors::by_errors(const Camera& camera, const Eigen::Vector3d& point) const {
  Camera::ParameterJacobian by_parameters;
  if (!camera.project(point, nullptr, &by_parameters))
    return Eigen::Matrix2Xd::Zero(2, root_.cols());
  return by_parameters * root_;
}

Eigen::Matrix2d image_covariance_px2(const Lamp& lamp, const Rigid3& cam_from_world,
                                     const Camera& camera,
                                     const std::optional<LampErrors>& errors) {
  Eigen::Matrix<double, 2, 3> by_shift;
  if (!errors || !camera.project(cam_from_world * lamp.centre_m, &by_shift))
    return Eigen::Matrix2d::Zero();
  const Eigen::Matrix<double, 2, 3> by_errors =
      by_shift * cam_from_world.rotation * errors->position_m.asDiagonal();
  return by_errors * by_errors.transpose();
}

Eigen::Matrix2d image_covariance_px2(const Lamp& lamp, const Rigid3& cam_from_world,
                                     const Scene& scene) {
  Eigen::Matrix2d covariance =
      image_covariance_px2(lamp, cam_from_world, scene.camera, errors_of(lamp, scene));
  if (!scene.camera.is_exact()) {
    const Eigen::Matrix2Xd by_errors =
        CameraErrors(scene.camera).by_errors(scene.camera, cam_from_world * lamp.centre_m);
    covariance += by_errors * by_errors.transpose();
  }
  return covariance;
}

}  // namespace occ::internal::refine
