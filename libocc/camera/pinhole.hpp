// SPDX-License-Identifier: Apache-2.0
// Pinhole camera with OpenCV's lens distortion:
//
//   (x, y) = (X/Z, Y/Z),  r^2 = x^2 + y^2
//   radial = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
//   x' = x radial + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4
//   y' = y radial + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 + s4 r^4
//   (x'', y''): (x', y') after the homography of the sensor tilted by (tau_x, tau_y)
//   u = fx x'' + skew y'' + cx,  v = fy y'' + cy
//
// Coefficients in OpenCV's order k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]]: 0, 4, 5,
// 8, 12 or 14 of them. Domain: Z > 0, and r below the first radius at which the distorted radius
// stops growing (beyond it two rays would share a pixel). Source: OpenCV 4.6 documentation, module
// calib3d, "Detailed Description".
#pragma once

#include <array>

#include "libocc/camera/model.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Model of a lens of normal or wide angle; `Camera::pinhole` creates one.
class LIBOCC_API PinholeModel final : public CameraModel {
 public:
  /// `distortion`: 0, 4, 5, 8, 12 or 14 coefficients. Throws std::invalid_argument for other
  /// counts.
  PinholeModel(int width, int height, const CameraMatrix& matrix,
               const std::vector<double>& distortion);
  std::vector<CameraParameter> parameters() const override;
  int parameter_count() const override { return 5 + static_cast<int>(distortion_.size()); }
  Pointer with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, PointJacobian* d_point,
                                         ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           PixelJacobian* jacobian) const override;
  double max_angle_rad() const override;
  double depth_m(const Eigen::Vector3d& point, Eigen::Vector3d* gradient) const override;
  Pointer without_distortion() const override;

 private:
  /// d pixel / d parameters from the point on the plane z = 1 after each step.
  void differentiate(const Eigen::Vector2d& undistorted, const Eigen::Vector2d& distorted,
                     const Eigen::Vector2d& on_sensor, const Eigen::Matrix2d& d_tilt,
                     ParameterJacobian& d_parameters) const;

  std::array<double, 14> k_{};  // coefficients, padded with zeros
  bool distorts_ = false;       // a coefficient other than the tilt is not zero
  bool tilted_ = false;
  Eigen::Matrix3d tilt_ = Eigen::Matrix3d::Identity();
  double max_radius_squared_ = 0;  // domain's limit of r^2, infinite if there is none
};

}  // namespace occ
