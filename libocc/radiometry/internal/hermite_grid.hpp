// SPDX-License-Identifier: Apache-2.0
// Interpolates values on a rectangular grid by bicubic Hermite polynomials. Value and first
// derivatives are continuous.
//
// The slopes at the nodes are those of the polynomial through five neighbours (three at the ends),
// limited as in Huynh, "Accurate monotone cubic interpolation", SIAM J. Numer. Anal. 30(1) 1993:
// monotone data give a monotone curve in each row and column, and smooth maxima are not clipped.
// Values are not negative, and neither are the curves along rows and columns.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace occ::internal::radiometry {

/// Slopes of a curve through values at ascending positions.
std::vector<double> limited_slopes(const std::vector<double>& at,
                                   const std::vector<double>& values);

/// A value of a surface and its derivatives.
struct SurfacePoint {
  double value = 0, by_x = 0, by_y = 0;
};

/// Positions ascend; matrices have one row per x and one column per y.
struct HermiteGrid {
  std::vector<double> x, y;
  Eigen::MatrixXd f, f_x, f_y, f_xy;

  /// Computes the derivatives f_x, f_y and f_xy from f.
  void set_slopes();
  /// A position outside the grid is moved to its border.
  SurfacePoint at(double px, double py) const;
};

}  // namespace occ::internal::radiometry
