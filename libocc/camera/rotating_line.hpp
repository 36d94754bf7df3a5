// SPDX-License-Identifier: Apache-2.0
// Rotating line camera: a linear array, parallel to a turntable's axis, sweeps 360 degrees.
//
// A column is an angle of the turntable, a row a position on the array. The camera frame is the
// turntable's: Z along its axis, towards increasing rows (down, if the picture is upright), columns
// increasing from X to Y (to the right). With a small rotation W (tumbling), theta = angle_per_px
// col and eta = (row - cy_px) / c_px:
//
//   X = W(theta) R_Z(theta) [ lambda R_Y(ly) R_X(lx) (1, 0, h)^T + e ],   lambda > 0
//   h = eta - eta^3 (k1 + k2 eta^2)
//   W = R_X(w_x) R_Y(w_y),  w_x + i w_y = T1 e^(-i theta) + T2 e^(2 i theta) + T3 e^(-2 i theta)
//
// (A term with e^0 would be the camera's orientation, a term with e^(i theta) lx and ly.)
// Projection uses Newton's method with tumbling, and a closed form without:
//
//   n = R_Y(ly) R_X(lx) e_y,  N = hypot(nx, ny),  rho = hypot(X, Y)
//   theta = atan2(Y, X) + atan2(nx, ny) - asin((n.e - nz Z) / (N rho))
//
// `Camera::rotating_line_first_order` is the additive first-order form of the paper: each term is
// evaluated at the image point as if the others were zero, and e is rotated by the column's nominal
// angle 2 pi col / width.
//
// Domain: eta below the first value at which h stops growing; rho large enough for the asin.
// Source: Amiri Parian, Gruen, "Sensor modeling, self-calibration and accuracy testing of panoramic
// cameras", ISPRS Journal 65, 2010. The closed form and the Fourier terms are derived here.
#pragma once

#include <Eigen/Core>
#include <array>

#include "libocc/core/abi.hpp"

namespace occ {

/// Parameters of a rotating line camera.
struct RotatingLine {
  int width = 0, height = 0;    ///< columns of the sweep and rows of the array
  double angle_per_px_rad = 0;  ///< between columns; 0: 2 pi / width
  double c_px = 0;              ///< camera constant over the pixel pitch of the array
  double cy_px = 0;             ///< principal point: the row of the horizon
  double tilt_x_rad = 0;        ///< lx, tilt of the array about the direction of view
  double tilt_y_rad = 0;        ///< ly, tilt across it, which turns the horizon into a cone
  Eigen::Vector3d eccentricity_m =
      Eigen::Vector3d::Zero();           ///< e, position of the projection centre
  double k1 = 0, k2 = 0;                 ///< radial distortion along the array
  std::array<double, 6> tumbling_rad{};  ///< T1, T2, T3: real and imaginary parts
};

}  // namespace occ
