// SPDX-License-Identifier: Apache-2.0
// Double sphere camera:
//
//   d1 = |(X, Y, Z)|,  d2 = |(X, Y, xi d1 + Z)|
//   (x', y') = (X, Y) / (alpha d2 + (1 - alpha) (xi d1 + Z)),  u = fx x' + cx,  v = fy y' + cy
//
// Domain: Z > -w2 d1 with w2 of eqs 44 and 45 (one ray for each pixel).
// Source: Usenko, Demmel, Cremers, "The double sphere camera model", 3DV 2018, eqs 40-50.
#pragma once

#include "libocc/camera/model.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

class LIBOCC_API DoubleSphereModel final : public CameraModel {
 public:
  DoubleSphereModel(int width, int height, const CameraMatrix& matrix, double xi, double alpha);
  std::vector<CameraParameter> parameters() const override;
  int parameter_count() const override { return 6; }
  Pointer with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, PointJacobian* d_point,
                                         ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           PixelJacobian* jacobian) const override;
  double max_angle_rad() const override;

 private:
  double xi_, alpha_, w1_, w2_;
};

}  // namespace occ
