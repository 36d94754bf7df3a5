// SPDX-License-Identifier: Apache-2.0
// Rotating line camera: a linear array, parallel to a turntable's axis, sweeps 360 degrees. A
// column is an angle of the turntable, a row a position on the array. The camera's frame is the
// turntable's: Z along its axis, towards growing rows (down, when the picture is upright), columns
// growing from X to Y (to the right). With W a small turn (tumbling), theta = angle_per_px col,
// eta = (row - cy_px) / c_px and
//
//   X = W(theta) R_Z(theta) [ lambda R_Y(ly) R_X(lx) (1, 0, h)^T + e ],   lambda > 0
//   h = eta - eta^3 (k1 + k2 eta^2)
//   W = R_X(w_x) R_Y(w_y),  w_x + i w_y = T1 e^(-i theta) + T2 e^(2 i theta) + T3 e^(-2 i theta)
//
// (what T would add with e^0 is the camera's orientation, with e^(i theta) lx and ly). Projection
// has a closed form without tumbling, Newton's method with it:
//
//   n = R_Y(ly) R_X(lx) e_y,  N = hypot(nx, ny),  rho = hypot(X, Y)
//   theta = atan2(Y, X) + atan2(nx, ny) - asin((n.e - nz Z) / (N rho))
//
// Model: Amiri Parian, Gruen, "Sensor modeling, self-calibration and accuracy testing of panoramic
// cameras", ISPRS Journal 65, 2010; the closed form and the Fourier terms are derived here. Their
// additive first-order form (every term at the image point as if it were alone, e turned by the
// column's nominal angle 2 pi col / width) is `Camera::rotating_line_first_order`.
// Domain: h is a growing function of eta; rho large enough for the asin; outside it: nothing.
#pragma once

#include <Eigen/Core>
#include <array>

#include "libocc/core/abi.hpp"

namespace occ {

struct RotatingLine {
  int width = 0, height = 0;
  double angle_per_px_rad = 0;  ///< of a column; 0: 2 pi / width
  double c_px = 0;              ///< camera constant over the array's pixel pitch
  double cy_px = 0;             ///< principal point: the row of the horizon
  double tilt_x_rad = 0;        ///< lx, about the direction of view
  double tilt_y_rad = 0;        ///< ly, across it: the horizon becomes a cone
  Eigen::Vector3d eccentricity_m = Eigen::Vector3d::Zero();  ///< e, of the projection centre
  double k1 = 0, k2 = 0;                                     ///< radial distortion along the array
  std::array<double, 6> tumbling_rad{};  ///< T1, T2, T3: real and imaginary part of each
};

}  // namespace occ
