// SPDX-License-Identifier: Apache-2.0
// Initial values for the distances of P3P (p3p_roots.hpp) as intersections of two conics.
//
// The unknowns are the differences u = d_0 - d_2, v = d_1 - d_2 and w = d_2. w is scaled by
// sqrt(sum of squared chords), so that numbers have similar sizes at narrow and wide angles. Each
// distance equation is a conic Q_k(u, v, w) = side2_k, and
//     A = Q_2 - side2_2 (Q_0 + Q_1 + Q_2) = 0,   B = Q_1 - side2_1 (Q_0 + Q_1 + Q_2) = 0
// are two conics. Their at most four intersections are the roots up to scale. A member x A + y B of
// their pencil is a pair of lines if its determinant, a cubic in (x : y), vanishes. These lines
// meet any other member of the pencil in the intersections.
//
// Source of the approach: Ding, Yang, Larsson, Olsson, Astrom, "Revisiting the P3P Problem", CVPR
// 2023, and Persson, Nordberg, "Lambda Twist", ECCV 2018. Chords and differences replace their
// cosines, and all numbers are homogeneous.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "libocc/core/abi.hpp"
#include "libocc/pose/internal/p3p_roots.hpp"

namespace occ::internal::pose {

/// A symmetric 3x3 matrix.
struct Conic {
  double uu, vv, ww, uv, uw, vw;
};

inline Conic adjugate(const Conic& c) {
  return {c.vv * c.ww - c.vw * c.vw, c.uu * c.ww - c.uw * c.uw, c.uu * c.vv - c.uv * c.uv,
          c.uw * c.vw - c.uv * c.ww, c.uv * c.vw - c.uw * c.vv, c.uv * c.uw - c.uu * c.vw};
}

inline double trace_of_product(const Conic& a, const Conic& b) {
  return a.uu * b.uu + a.vv * b.vv + a.ww * b.ww + 2 * (a.uv * b.uv + a.uw * b.uw + a.vw * b.vw);
}

inline Conic combined(double x, const Conic& a, double y, const Conic& b) {
  return {x * a.uu + y * b.uu, x * a.vv + y * b.vv, x * a.ww + y * b.ww,
          x * a.uv + y * b.uv, x * a.uw + y * b.uw, x * a.vw + y * b.vw};
}

/// Cube root of x >= 0 to 4 %, by dividing the exponent of the floating-point number by three.
inline double approximate_cube_root(double x) {
  std::uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  bits = bits / 3 + 0x2A9F7893782DA1CE;
  std::memcpy(&x, &bits, sizeof bits);
  return x;
}

/// The real root of t^3 + b t^2 + c t + d that is farthest from the others. In the depressed cubic
/// s^3 + p s + q it is the root of sign -q. Newton's method starts at most 20 % above it for p < 0.
inline double separated_root(double b, double c, double d) {
  const double shift = b * (1.0 / 3);
  const double p = c - b * shift;
  const double q = d + shift * (2 * shift * shift - c);
  const double magnitude = std::abs(q);
  const double width = std::sqrt(std::max(0.0, -p));
  double s = approximate_cube_root(width * width * width + 1.5 * magnitude), before;
  const auto improve = [&] { return (2 * s * s * s + magnitude) / (3 * s * s + p); };
  s = improve();
  s = improve();
  for (int i = 0; i < 40; ++i) {
    before = s;
    s = improve();
    if (std::abs(s - before) < 1e-3 * s) break;
  }
  const double t = (q <= 0 ? s : -s) - shift;
  // One step on the cubic itself restores the digits lost by the shift.
  const double step = (((t + b) * t + c) * t + d) / ((3 * t + 2 * b) * t + c);
  return std::abs(step) < 1e-5 * (std::abs(t) + s) ? t - step : t;
}

struct Member {
  double x, y;
};

/// A member of the pencil with determinant 0.
inline Member degenerate_member(const Conic& a, const Conic& b) {
  const Conic adj_a = adjugate(a), adj_b = adjugate(b);
  // det(x a + y b) = c[0] x^3 + c[1] x^2 y + c[2] x y^2 + c[3] y^3
  const double c[4] = {a.uu * adj_a.uu + a.uv * adj_a.uv + a.uw * adj_a.uw,
                       trace_of_product(adj_a, b), trace_of_product(adj_b, a),
                       b.uu * adj_b.uu + b.uv * adj_b.uv + b.uw * adj_b.uw};
  const double ends = std::max(std::abs(c[0]), std::abs(c[3]));
  if (ends < 0.05 * std::max(std::abs(c[1]), std::abs(c[2]))) {
    // Both conics are nearly degenerate: y = z - k x with k = 1 or -1 makes the coefficient of x^3
    // large.
    const double k = (c[0] + c[2]) * (c[1] + c[3]) > 0 ? -1 : 1;
    const double lead = c[0] - k * c[1] + c[2] - k * c[3], inverse = 1 / lead;
    const double x = separated_root((c[1] - 2 * k * c[2] + 3 * c[3]) * inverse,
                                    (c[2] - 3 * k * c[3]) * inverse, c[3] * inverse);
    return {x, 1 - k * x};
  }
  const bool forward = std::abs(c[0]) >= std::abs(c[3]);
  const int first = forward ? 0 : 3, step = forward ? 1 : -1;
  const double inverse = 1 / c[first];
  const double root = separated_root(c[first + step] * inverse, c[first + 2 * step] * inverse,
                                     c[first + 3 * step] * inverse);
  return forward ? Member{root, 1} : Member{1, root};
}

/// True for a double line, whose adjugate consists of rounding errors of either sign.
inline bool is_double_line(const Conic& c, const Conic& adj) {
  const double size = std::max({std::abs(c.uu), std::abs(c.vv), std::abs(c.ww), std::abs(c.uv),
                                std::abs(c.uw), std::abs(c.vw)});
  return std::max({adj.uu, adj.vv, adj.ww}) <= 1e-13 * size * size;
}

struct LinePair {
  double first[3], second[3];
};

/// The lines l, m of a degenerate conic l m^T + m l^T; returns false if they are not real. The
/// conic's adjugate is -(l x m)(l x m)^T; adding the cross-product matrix of l x m yields 2 l m^T.
inline bool split(const Conic& c, LinePair& lines) {
  const Conic adj = adjugate(c);
  const double columns[3][3] = {
      {adj.uu, adj.uv, adj.uw}, {adj.uv, adj.vv, adj.vw}, {adj.uw, adj.vw, adj.ww}};
  const int i = argmax(-adj.uu, -adj.vv, -adj.ww);
  const double square = -columns[i][i], *v = columns[i];
  if (!(square > 0) && !is_double_line(c, adj)) return false;
  const double f = square > 0 ? std::sqrt(square) : 1;
  const double uv = f * c.uv, uw = f * c.uw, vw = f * c.vw;
  const double n[3][3] = {{f * c.uu, uv - v[2], uw + v[1]},
                          {uv + v[2], f * c.vv, vw - v[0]},
                          {uw - v[1], vw + v[0], f * c.ww}};
  const int row = argmax(std::abs(n[0][0]) + std::abs(n[0][1]) + std::abs(n[0][2]),
                         std::abs(n[1][0]) + std::abs(n[1][1]) + std::abs(n[1][2]),
                         std::abs(n[2][0]) + std::abs(n[2][1]) + std::abs(n[2][2]));
  const int column = argmax(std::abs(n[0][0]) + std::abs(n[1][0]) + std::abs(n[2][0]),
                            std::abs(n[0][1]) + std::abs(n[1][1]) + std::abs(n[2][1]),
                            std::abs(n[0][2]) + std::abs(n[1][2]) + std::abs(n[2][2]));
  for (int e = 0; e < 3; ++e) {
    lines.first[e] = n[row][e];
    lines.second[e] = n[e][column];
  }
  return true;
}

/// The two points (u, v, w) of a conic on a line, up to scale; equal if the line is a tangent to
/// rounding. Returns false if they are not real.
inline bool intersect(const double c[3][3], const double l[3], double points[2][3]) {
  const int i = argmax(std::abs(l[0]), std::abs(l[1]), std::abs(l[2])), j = next(i), k = next(j);
  // A point of the line is e_j s + e_k t + e_i (y s + z t).
  const double inverse = -1 / l[i], y = l[j] * inverse, z = l[k] * inverse;
  // a s^2 + 2 b s t + g t^2 = 0
  const double a = (c[i][i] * y + 2 * c[i][j]) * y + c[j][j];
  const double b = (c[i][i] * y + c[i][j]) * z + c[i][k] * y + c[j][k];
  const double g = (c[i][i] * z + 2 * c[i][k]) * z + c[k][k];
  const double discriminant = b * b - a * g;
  const double h = -(b + std::copysign(std::sqrt(std::max(discriminant, 0.0)), b));
  const double s[2] = {h, g}, t[2] = {a, h};
  for (int n = 0; n < 2; ++n) {
    points[n][i] = y * s[n] + z * t[n];
    points[n][j] = s[n];
    points[n][k] = t[n];
  }
  // Rounding, amplified by that of the cubic, can make a double root complex.
  return discriminant >= -1e-5 * (b * b + std::abs(a * g));
}

}  // namespace occ::internal::pose
