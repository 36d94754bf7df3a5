// SPDX-License-Identifier: Apache-2.0
// The Lame curve (superellipse) |x|^n + |y|^n = 1, n >= 1: 1 is a square on its corner, 2 a circle,
// large n nearly a square with rounded corners. Split into pieces in each of which point and
// tangent are smooth functions of a parameter, so that Gauss-Legendre rules converge fast for every
// n: with u the smaller coordinate (an eighth of the curve), w = u^n and v = (1 - w)^(1/n),
//     w = exp(-14 (1 - s)) / 2   where the curve bends,
//     u = s u_0                  where w < 1e-6: a straight line.
#pragma once

#include <Eigen/Core>
#include <array>

#include "libocc/core/abi.hpp"

namespace occ::internal::formation {

struct LamePoint {
  Eigen::Vector2d at, tangent;  ///< tangent: derivative by the parameter
};

constexpr int lame_piece_count = 16;

/// Point of a piece at 0 <= s <= 1; the pieces are ordered counter-clockwise from (1, 0).
LamePoint lame_point(double exponent, int piece, double s);

/// Point of the curve in the direction of an angle.
Eigen::Vector2d lame_at_angle(double exponent, double angle_rad);

/// Nodes of a quadrature along the whole curve; tangents are multiplied by the weights.
std::array<LamePoint, 128> lame_nodes(double exponent);

}  // namespace occ::internal::formation
