// SPDX-License-Identifier: Apache-2.0
// Lame curve (superellipse) |x|^n + |y|^n = 1, n >= 1. n = 1 is a square standing on a corner, n =
// 2 a circle, and a large n nearly a square with rounded corners.
//
// The curve is divided into pieces in which point and tangent are smooth functions of a parameter
// s, so that Gauss-Legendre rules converge fast for every n. With the smaller coordinate u (1/8 of
// the curve), w = u^n and v = (1 - w)^(1/n), the pieces are
//     w = exp(-14 (1 - s)) / 2   for the curved part,
//     u = s u_0                  for w < 1e-6, practically a straight line.
#pragma once

#include <Eigen/Core>
#include <array>

#include "libocc/core/abi.hpp"

namespace occ::internal::formation {

struct LamePoint {
  Eigen::Vector2d at, tangent;  ///< the tangent is the derivative by the parameter
};

constexpr int lame_piece_count = 16;

/// Point of a piece at 0 <= s <= 1. The pieces are in counter-clockwise order from (1, 0).
LamePoint lame_point(double exponent, int piece, double s);

/// Point of the curve in the direction of an angle.
Eigen::Vector2d lame_at_angle(double exponent, double angle_rad);

/// Nodes of a quadrature rule along the whole curve; tangents are multiplied by the weights.
std::array<LamePoint, 128> lame_nodes(double exponent);

}  // namespace occ::internal::formation
