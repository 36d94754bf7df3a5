// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/scene_errors.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "libocc/camera/internal/parameter_values.hpp"
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
  return scene.map_scale_sigma == 0 &&
         std::none_of(scene.lamps.begin(), scene.lamps.end(), [&](const Lamp& lamp) {
           return errors_of(lamp, scene).has_value() || !lamp.shared_errors_m.empty();
         });
}

bool has_shared_errors(const Scene& scene) {
  return !scene.camera.is_exact() || scene.map_scale_sigma > 0 ||
         std::any_of(scene.lamps.begin(), scene.lamps.end(),
                     [](const Lamp& lamp) { return !lamp.shared_errors_m.empty(); });
}

bool is_exact(const Scene& scene) { return scene.camera.is_exact() && has_exact_map(scene); }

LampInCam with_error(LampInCam lamp, const LampError& error, const Rigid3& cam_from_world) {
  const Eigen::Matrix3d turn = so3_exp(cam_from_world.rotation * error.head<3>());
  lamp.centre_m += cam_from_world.rotation * error.segment<3>(3);
  lamp.normal = turn * lamp.normal;
  lamp.x_axis = turn * lamp.x_axis;
  lamp.radius_m *= 1 + error[6];
  lamp.size_m *= 1 + error[6];
  for (Eigen::Vector2d& corner : lamp.corners_m) corner *= 1 + error[6];
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

SharedErrors::SharedErrors(const Scene& scene)
    : root_(scene.camera.root_of_covariance()), scale_sigma_(scene.map_scale_sigma) {
  for (const Lamp& lamp : scene.lamps)
    map_count_ = std::max(map_count_, static_cast<Eigen::Index>(lamp.shared_errors_m.size()));
  if (!(scale_sigma_ > 0)) return;
  ++map_count_;
  middle_m_ = scene.mean_lamp_position_m();
}

void SharedErrors::apply(const Scene& stated, const Eigen::VectorXd& errors, Scene& scene) const {
  if (root_.cols() > 0) {
    const Eigen::VectorXd values =
        root_ * errors.head(root_.cols()) + camera::parameter_values(stated.camera);
    scene.camera = stated.camera.with_parameters(values);
  }
  const Eigen::VectorXd of_map = errors.tail(map_count_);
  const double scale_error = scale_sigma_ > 0 ? scale_sigma_ * of_map[map_count_ - 1] : 0;
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    const Lamp& from = stated.lamps[i];
    Lamp& lamp = scene.lamps[i];
    lamp.centre_m = from.centre_m + scale_error * (from.centre_m - middle_m_);
    for (std::size_t j = 0; j < lamp.shared_errors_m.size(); ++j)
      lamp.centre_m += of_map[static_cast<Eigen::Index>(j)] * lamp.shared_errors_m[j];
    lamp.radius_m = (1 + scale_error) * from.radius_m;
    lamp.size_m = (1 + scale_error) * from.size_m;
    for (std::size_t j = 0; j < lamp.corners_m.size(); ++j)
      lamp.corners_m[j] = (1 + scale_error) * from.corners_m[j];
  }
}

Eigen::Matrix3Xd SharedErrors::motion(const Lamp& lamp, const Rigid3& cam_from_world) const {
  Eigen::Matrix3Xd motion = Eigen::Matrix3Xd::Zero(3, map_count_);
  for (std::size_t j = 0; j < lamp.shared_errors_m.size(); ++j)
    motion.col(static_cast<Eigen::Index>(j)) = cam_from_world.rotation * lamp.shared_errors_m[j];
  if (scale_sigma_ > 0) motion.rightCols<1>() = -scale_sigma_ * (cam_from_world * middle_m_);
  return motion;
}

Eigen::Matrix2Xd SharedErrors::by_errors(const Camera& camera, const Lamp& lamp,
                                         const Rigid3& cam_from_world,
                                         const Eigen::Matrix<double, 2, 3>& by_shift) const {
  Eigen::Matrix2Xd out(2, count());
  out.leftCols(root_.cols()) = by_camera(camera, cam_from_world * lamp.centre_m);
  if (map_count_ > 0) out.rightCols(map_count_) = by_shift * motion(lamp, cam_from_world);
  return out;
}

Eigen::Matrix2Xd SharedErrors::by_camera(const Camera& camera, const Eigen::Vector3d& point) const {
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
  Eigen::Matrix<double, 2, 3> by_shift;
  if (has_shared_errors(scene) && scene.camera.project(cam_from_world * lamp.centre_m, &by_shift)) {
    const Eigen::Matrix2Xd by_errors =
        SharedErrors(scene).by_errors(scene.camera, lamp, cam_from_world, by_shift);
    covariance += by_errors * by_errors.transpose();
  }
  return covariance;
}

}  // namespace occ::internal::refine
