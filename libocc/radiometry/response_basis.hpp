// SPDX-License-Identifier: Apache-2.0
// Responses of cameras in few numbers: a mean curve and the functions in which curves differ most,
//     f(x) = f_0(x) + c_1 h_1(x) + c_2 h_2(x) + ...,   f(0) = 0, f(1) = 1,
// as Grossberg and Nayar ("What is the space of camera response functions?", CVPR 2003) found them
// in measured curves. Here the curves are a family of formulas: powers, logarithms, saturating ones
// (Naka and Rushton) and these with more or less contrast; h_k are its principal components.
// Powers from 1 to 1/3 and sRGB's curve come out to 0.012 with three functions, to 0.005 with five.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "libocc/core/abi.hpp"

namespace occ {

struct ResponseBasis {
  Eigen::VectorXd mean;       ///< f_0 at evenly spaced x from 0 to 1
  Eigen::MatrixXd functions;  ///< h_k, a column each, orthogonal, of mean square 1
};

/// 1 <= count <= 8 functions at 16 <= samples <= 65536 places.
LIBOCC_API ResponseBasis response_basis(int count, int samples = 1024);

/// The curve of one to eight coefficients, for Sensor::response_table. Throws std::invalid_argument
/// when it does not rise everywhere.
LIBOCC_API std::vector<double> response_curve(const std::vector<double>& coefficients,
                                              int samples = 1024);

/// Coefficients of the curve next to a table (its evenly spaced values from 0 to 1) in the mean of
/// squares.
LIBOCC_API std::vector<double> response_coefficients(const std::vector<double>& table, int count);

}  // namespace occ
