// SPDX-License-Identifier: Apache-2.0
// What every camera but the pinhole provides; semantics as in camera.hpp.
#pragma once

#include "libocc/camera/camera.hpp"

namespace occ::internal::camera {

class CameraModel {
 public:
  using Jacobian23 = Eigen::Matrix<double, 2, 3>;
  using Jacobian32 = Eigen::Matrix<double, 3, 2>;
  virtual ~CameraModel() = default;

  virtual std::vector<CameraParameter> parameters() const = 0;
  virtual Camera with_parameters(const Eigen::VectorXd& values) const = 0;
  virtual std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, Jacobian23* d_point,
                                                 Camera::ParameterJacobian* d_parameters) const = 0;
  virtual std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                                   Jacobian32* jacobian) const = 0;
  virtual Eigen::Vector3d origin(const Eigen::Vector2d& pixel) const;
  virtual double max_angle_rad() const = 0;
  virtual bool is_central() const { return true; }
};

}  // namespace occ::internal::camera
