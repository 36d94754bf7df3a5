// SPDX-License-Identifier: Apache-2.0
// The camera's geometry: a pinhole with OpenCV's lens distortion.
//
//   (x, y) = (X/Z, Y/Z),  r^2 = x^2 + y^2
//   radial = (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
//   x' = x radial + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4
//   y' = y radial + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 + s4 r^4
//   then the tilted-sensor homography of (tau_x, tau_y), then u = fx x' + skew y' + cx, v = fy y' +
//   cy.
//
// Coefficients in OpenCV's order k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4 [tau_x tau_y]]]]: 0, 4, 5,
// 8, 12 or 14 of them. Source: OpenCV 4.6 documentation, module calib3d, "Detailed Description".
//
// Domain: Z > 0 and r below the first radius at which the distorted radius stops growing (beyond it
// two rays would share a pixel). Outside it `project` and `unproject` return nothing.
#pragma once

#include "libocc/core/abi.hpp"
//
#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

namespace occ {

class LIBOCC_API Camera {
 public:
  /// Throws std::invalid_argument naming the argument: sizes and focal lengths must be positive,
  /// every number finite, distortion of 0, 4, 5, 8, 12 or 14 coefficients, tilts within pi/2.
  static Camera pinhole(int width, int height, double fx_px, double fy_px, double cx_px,
                        double cy_px, const std::vector<double>& distortion = {},
                        double skew_px = 0);

  Camera without_distortion() const;

  Camera() : Camera(pinhole(640, 480, 500, 500, 319.5, 239.5)) {}

  int width() const { return width_; }
  int height() const { return height_; }
  double fx_px() const { return fx_; }
  double fy_px() const { return fy_; }
  double cx_px() const { return cx_; }
  double cy_px() const { return cy_; }
  double skew_px() const { return skew_; }
  const std::vector<double>& distortion() const { return distortion_; }
  Eigen::Matrix3d matrix() const;  ///< K

  /// Largest angle from the optical axis inside the domain [rad]; pi/2 when nothing limits it.
  double max_angle_rad() const;

  /// Pixel of a point in the camera's frame [m], or nothing outside the domain. A pixel may lie
  /// outside the image: ask `contains`. `jacobian` (2x3, optional): d pixel / d point.
  std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& point_in_cam,
                                         Eigen::Matrix<double, 2, 3>* jacobian = nullptr) const;

  /// Unit bearing of a pixel, or nothing outside the domain. `jacobian` (3x2, optional): d bearing
  /// / d pixel. project(unproject(p)) == p to 1e-9 px.
  std::optional<Eigen::Vector3d> unproject(const Eigen::Vector2d& pixel,
                                           Eigen::Matrix<double, 3, 2>* jacobian = nullptr) const;

  /// Whether a pixel lies on the sensor: -0.5 <= x < width - 0.5, and y alike.
  bool contains(const Eigen::Vector2d& pixel) const;

 private:
  struct Private {};
  explicit Camera(Private) {}

  int width_ = 0, height_ = 0;
  double fx_ = 0, fy_ = 0, cx_ = 0, cy_ = 0, skew_ = 0;
  std::vector<double> distortion_;
  std::array<double, 14> k_{};  // padded with zeros
  bool bends_ = false;          // some coefficient but the tilt is not zero
  bool tilted_ = false;
  Eigen::Matrix3d tilt_ = Eigen::Matrix3d::Identity();
  double max_radius_squared_ = 0;  // of r^2, infinity when unlimited
};

}  // namespace occ
