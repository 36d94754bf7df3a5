// SPDX-License-Identifier: Apache-2.0
#include "libocc/formation/internal/lame_curve.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/internal/quadrature.hpp"

namespace occ::internal::formation {

using namespace internal::core;
namespace {

constexpr double log_range = 14;  // ln of w at the diagonal over w at the straight part

// Point on the eighth of the curve from (1, 0) to the diagonal, which has two pieces.
LamePoint first_eighth(double n, bool curved, double s) {
  const double diagonal = std::pow(2, -1 / n);
  const double straight_end = diagonal * std::exp(-log_range / n);
  const double u = curved ? diagonal * std::exp(-log_range / n * (1 - s)) : straight_end * s;
  const double du = curved ? u * log_range / n : straight_end;
  const double rest = 1 - std::pow(u, n);
  const double v = std::pow(rest, 1 / n);
  return {{v, u}, {-std::pow(u, n - 1) * v / rest * du, du}};
}

Eigen::Vector2d rotated_by_quarters(const Eigen::Vector2d& p, int count) {
  switch (count) {
    case 0:
      return p;
    case 1:
      return {-p.y(), p.x()};
    case 2:
      return -p;
    default:
      return {p.y(), -p.x()};
  }
}

}  // namespace

LamePoint lame_point(double exponent, int piece, double s) {
  const int part = piece % 4;
  LamePoint point;
  if (part < 2) {
    point = first_eighth(exponent, part == 1, s);
  } else {  // mirrored about the diagonal, in reverse direction
    const LamePoint mirror = first_eighth(exponent, part == 2, 1 - s);
    point = {mirror.at.reverse(), -mirror.tangent.reverse()};
  }
  return {rotated_by_quarters(point.at, piece / 4), rotated_by_quarters(point.tangent, piece / 4)};
}

Eigen::Vector2d lame_at_angle(double exponent, double angle_rad) {
  const Eigen::Vector2d direction(std::cos(angle_rad), std::sin(angle_rad));
  const double sum = direction.array().abs().pow(exponent).sum();
  return direction / std::pow(sum, 1 / exponent);
}

std::array<LamePoint, 128> lame_nodes(double exponent) {
  static const std::vector<QuadratureNode> straight = gauss_legendre(4),
                                           curved = gauss_legendre(12);
  std::array<LamePoint, 128> nodes;
  std::size_t count = 0;
  for (int piece = 0; piece < lame_piece_count; ++piece) {
    const bool is_curved = piece % 4 == 1 || piece % 4 == 2;
    for (const QuadratureNode& node : is_curved ? curved : straight) {
      LamePoint& point = nodes[count++] = lame_point(exponent, piece, node.at);
      point.tangent *= node.weight;
    }
  }
  return nodes;
}

}  // namespace occ::internal::formation
