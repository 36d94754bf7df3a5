// SPDX-License-Identifier: Apache-2.0
// The double sphere camera: Usenko, Demmel, Cremers, "The double sphere camera model", 3DV 2018.
#pragma once

#include "libocc/camera/internal/model.hpp"
#include "libocc/camera/internal/plane_map.hpp"

namespace occ::internal::camera {

class DoubleSphereModel final : public CameraModel {
 public:
  DoubleSphereModel(int width, int height, const PlaneMap& map, double xi, double alpha);
  std::vector<CameraParameter> parameters() const override;
  Camera with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, Jacobian23* d_point,
                                         Camera::ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           Jacobian32* jacobian) const override;
  double max_angle_rad() const override;

 private:
  int width_, height_;
  PlaneMap map_;
  double xi_, alpha_, w1_, w2_;
};

}  // namespace occ::internal::camera
