// SPDX-License-Identifier: Apache-2.0
// OpenCV's lens distortion on the plane z = 1, and its tilted sensor; equations in pinhole.hpp.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "libocc/core/abi.hpp"

namespace occ::internal::camera {

using DistortionCoefficients = std::array<double, 14>;

/// Distorted point, without the tilt; `jacobian` (optional): d distorted / d undistorted.
Eigen::Vector2d distort(const DistortionCoefficients& k, const Eigen::Vector2d& undistorted,
                        Eigen::Matrix2d* jacobian = nullptr);

/// d distorted / d (first twelve coefficients).
Eigen::Matrix<double, 2, 12> distort_by_coefficients(const DistortionCoefficients& k,
                                                     const Eigen::Vector2d& undistorted);

/// First r^2 at which the distorted radius stops growing, infinity if there is none.
double domain_radius_squared(const DistortionCoefficients& k);

/// Inverse of `distort` inside the domain, or nothing.
std::optional<Eigen::Vector2d> undistort(const DistortionCoefficients& k, double max_radius_squared,
                                         const Eigen::Vector2d& distorted);

/// Homography of the tilted sensor: OpenCV 4.6 documentation, calib3d, "tilted image sensor".
Eigen::Matrix3d tilt_homography(double tau_x_rad, double tau_y_rad);

/// d (point after the tilt) / d (tau_x, tau_y).
Eigen::Matrix2d tilt_by_angles(double tau_x_rad, double tau_y_rad, const Eigen::Vector2d& point);

}  // namespace occ::internal::camera
