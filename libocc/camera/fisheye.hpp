// SPDX-License-Identifier: Apache-2.0
// Fisheye camera of Kannala and Brandt:
//
//   r = hypot(X, Y),  a = atan2(r, Z),  d = a (1 + k1 a^2 + k2 a^4 + k3 a^6 + k4 a^8)
//   (x', y') = d / r (X, Y),  u = fx x' + skew y' + cx,  v = fy y' + cy
//
// The bearing of a pixel follows from the root a of d(a) = hypot(x', y'), by Newton's method.
//
// Domain: a below pi and below the first angle at which d stops growing.
// Source: Kannala, Brandt, "A generic camera model and calibration method for conventional,
// wide-angle, and fish-eye lenses", PAMI 28(8), 2006, eq. 6, in the form of OpenCV 4.6.
#pragma once

#include <array>

#include "libocc/camera/model.hpp"
#include "libocc/core/abi.hpp"

namespace occ {

/// Model of a fisheye lens; `Camera::fisheye` creates one.
class LIBOCC_API FisheyeModel final : public CameraModel {
 public:
  /// `distortion`: k1 to k4, trailing ones may be missing. Throws std::invalid_argument for more.
  FisheyeModel(int width, int height, const CameraMatrix& matrix,
               const std::vector<double>& distortion);
  std::vector<CameraParameter> parameters() const override;
  int parameter_count() const override { return 5 + static_cast<int>(distortion_.size()); }
  Pointer with_parameters(const Eigen::VectorXd& values) const override;
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point, PointJacobian* d_point,
                                         ParameterJacobian* d_parameters) const override;
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           PixelJacobian* jacobian) const override;
  double max_angle_rad() const override { return max_angle_; }
  Pointer without_distortion() const override;

 private:
  double distorted(double angle) const;              // d of the angle a
  double slope(double angle) const;                  // d d / d a
  double undistorted(double distorted_angle) const;  // inverse of `distorted`

  std::array<double, 4> k_{};  // padded with zeros
  double max_angle_;
};

}  // namespace occ
