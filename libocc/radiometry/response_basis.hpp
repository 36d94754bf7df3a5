// SPDX-License-Identifier: Apache-2.0
// Low-dimensional model of camera response curves: a mean curve and principal components,
//     f(x) = f_0(x) + c_1 h_1(x) + c_2 h_2(x) + ...,   f(0) = 0, f(1) = 1,
// after Grossberg and Nayar ("What is the space of camera response functions?", CVPR 2003), who
// derived them from measured curves. Here the curves are a family of formulas: powers, logarithms
// and saturating curves (Naka and Rushton), each with three levels of contrast.
// Powers from 1 to 1/3 and sRGB's curve are approximated within 0.012 by three functions and within
// 0.005 by five.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

/// Mean curve and principal components of response curves.
struct ResponseBasis {
  Eigen::VectorXd mean;       ///< f_0 at evenly spaced x from 0 to 1
  Eigen::MatrixXd functions;  ///< one column per h_k; orthogonal, with mean square 1
};

/// Basis with 1 <= count <= 8 functions at 16 <= samples <= 65536 values of x.
LIBOCC_API ResponseBasis response_basis(int count, int samples = 1024);

/// Curve for one to eight coefficients, for Sensor::response_table. Throws std::invalid_argument if
/// it does not increase strictly.
LIBOCC_API std::vector<double> response_curve(const std::vector<double>& coefficients,
                                              int samples = 1024);

/// Coefficients of the least-squares approximation of a table (values at evenly spaced x from 0 to
/// 1).
LIBOCC_API std::vector<double> response_coefficients(const std::vector<double>& table, int count);

}  // namespace occ
