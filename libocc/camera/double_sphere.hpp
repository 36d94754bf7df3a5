// SPDX-License-Identifier: Apache-2.0
// Double sphere camera:
//
//   d1 = |(X, Y, Z)|,  d2 = |(X, Y, xi d1 + Z)|
//   (x', y') = (X, Y) / (alpha d2 + (1 - alpha) (xi d1 + Z)),  u = fx x' + cx,  v = fy y' + cy
//
// and back, with r^2 = x'^2 + y'^2,
//
//   m = (1 - alpha^2 r^2) / (alpha sqrt(1 - (2 alpha - 1) r^2) + 1 - alpha)
//   bearing = (m xi + sqrt(m^2 + (1 - xi^2) r^2)) / (m^2 + r^2) (x', y', m) - (0, 0, xi)
//
// Parameters: -1 < xi <= 1, 0 <= alpha <= 1. Domain: Z > -w2 d1, where one ray belongs to each
// pixel, with w1 = min(alpha, 1 - alpha) / max(alpha, 1 - alpha) and
// w2 = (w1 + xi) / sqrt(2 w1 xi + xi^2 + 1); pixels with r^2 < 1 / (2 alpha - 1) for alpha > 1/2.
// Source: Usenko, Demmel, Cremers, "The double sphere camera model", 3DV 2018, eqs 40-50.
#pragma once

#include "libocc/camera/model.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Model of a lens with a view of more than 180 degrees; `Camera::double_sphere` creates one.
class LIBOCC_API DoubleSphereModel final : public CameraModel {
 public:
  /// Throws std::invalid_argument unless -1 < xi <= 1 and 0 <= alpha <= 1.
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
