// SPDX-License-Identifier: Apache-2.0
// Kannala and Brandt's fisheye; equations in camera.hpp.
#pragma once

#include <array>
#include <vector>

#include "libocc/camera/internal/model.hpp"
#include "libocc/camera/internal/plane_map.hpp"

namespace occ::internal::camera {

class FisheyeModel final : public CameraModel {
 public:
  FisheyeModel(int width, int height, const PlaneMap& map, const std::vector<double>& k);
  std::vector<CameraParameter> parameters() const override;
  Camera with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, Jacobian23* d_point,
                                         Camera::ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           Jacobian32* jacobian) const override;
  double max_angle_rad() const override { return max_angle_; }

 private:
  double bent(double angle) const;   // d of the angle a
  double slope(double angle) const;  // its derivative
  double straight(double bent_angle) const;

  int width_, height_;
  PlaneMap map_;
  std::size_t coefficients_;
  std::array<double, 4> k_{};
  double max_angle_;
};

}  // namespace occ::internal::camera
