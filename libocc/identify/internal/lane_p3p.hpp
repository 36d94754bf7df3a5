// SPDX-License-Identifier: Apache-2.0
// P3P for several assignments of the same three blobs at once, in single precision. Returns the
// distances of the three lamps with a relative error of about 1e-5.
//
// The equations and the method are those of pose/internal/conic_pencil.hpp, which lists the
// sources. Branches are replaced by selections, so that all lanes run the same instructions.
#pragma once

#include "libocc/core/internal/lanes.hpp"

namespace occ::internal::identify {

/// Squared chords |f_i - f_j|^2 between the unit bearings of three blobs.
struct Chords2 {
  float c01, c02, c12;
};

template <class Lanes>
struct LaneDepths {
  Lanes d0, d1, d2;
  core::LaneInts<Lanes> valid;
};

template <class Lanes>
struct LaneSides2 {
  Lanes s01, s02, s12;
};

template <class Lanes>
struct LaneConic {
  Lanes uu, vv, ww, uv, uw, vw;
};

template <class Lanes>
LIBOCC_INLINE LaneConic<Lanes> adjugate(const LaneConic<Lanes>& c) {
  return {c.vv * c.ww - c.vw * c.vw, c.uu * c.ww - c.uw * c.uw, c.uu * c.vv - c.uv * c.uv,
          c.uw * c.vw - c.uv * c.ww, c.uv * c.vw - c.uw * c.vv, c.uv * c.uw - c.uu * c.vw};
}

template <class Lanes>
LIBOCC_INLINE Lanes trace_of_product(const LaneConic<Lanes>& a, const LaneConic<Lanes>& b) {
  return a.uu * b.uu + a.vv * b.vv + a.ww * b.ww + 2 * (a.uv * b.uv + a.uw * b.uw + a.vw * b.vw);
}

template <class Lanes>
LIBOCC_INLINE LaneConic<Lanes> combined(const Lanes& x, const LaneConic<Lanes>& a, const Lanes& y,
                                        const LaneConic<Lanes>& b) {
  return {x * a.uu + y * b.uu, x * a.vv + y * b.vv, x * a.ww + y * b.ww,
          x * a.uv + y * b.uv, x * a.uw + y * b.uw, x * a.vw + y * b.vw};
}

/// Returns the real root of t^3 + b t^2 + c t + d that is farthest from the other roots, by a fixed
/// number of Newton steps from a rough start.
template <class Lanes>
LIBOCC_INLINE Lanes separated_root(const Lanes& b, const Lanes& c, const Lanes& d) {
  constexpr int steps = 7;
  const Lanes shift = b * (1.0F / 3);
  const Lanes p = c - b * shift;
  const Lanes q = d + shift * (2 * shift * shift - c);
  const Lanes magnitude = core::absolute(q);
  const Lanes width = core::root(-p);
  Lanes s = core::rough_cube_root(width * width * width + 1.5F * magnitude + 1e-30F);
  for (int i = 0; i < steps; ++i) s = (2 * s * s * s + magnitude) / (3 * s * s + p);
  return (q <= 0 ? s : -s) - shift;
}

template <class Lanes>
struct LaneMember {
  Lanes x, y;
};

/// Returns a member x A + y B of the pencil whose determinant is 0.
template <class Lanes>
LIBOCC_INLINE LaneMember<Lanes> degenerate_member(const LaneConic<Lanes>& a,
                                                  const LaneConic<Lanes>& b) {
  const LaneConic<Lanes> adj_a = adjugate(a), adj_b = adjugate(b);
  const Lanes c0 = a.uu * adj_a.uu + a.uv * adj_a.uv + a.uw * adj_a.uw;
  const Lanes c1 = trace_of_product(adj_a, b), c2 = trace_of_product(adj_b, a);
  const Lanes c3 = b.uu * adj_b.uu + b.uv * adj_b.uv + b.uw * adj_b.uw;
  const Lanes end0 = core::absolute(c0), end3 = core::absolute(c3), mid1 = core::absolute(c1),
              mid2 = core::absolute(c2);
  const Lanes ends = end0 > end3 ? end0 : end3, mids = mid1 > mid2 ? mid1 : mid2;
  const core::LaneInts<Lanes> substituted =
      ends < 0.05F * mids;  // substitute y = z - k x for a large leading coefficient
  const Lanes one = 1 + Lanes{};
  const Lanes k = substituted ? ((c0 + c2) * (c1 + c3) > 0 ? -one : one) : Lanes{};
  const core::LaneInts<Lanes> forward = substituted | (end0 >= end3);
  const Lanes t0 = forward ? c0 - k * c1 + c2 * k * k - k * k * k * c3 : c3;
  const Lanes t1 = forward ? c1 - 2 * k * c2 + 3 * k * k * c3 : c2;
  const Lanes t2 = forward ? c2 - 3 * k * c3 : c1;
  const Lanes t3 = forward ? c3 : c0;
  const Lanes inverse = 1 / t0;
  const Lanes r = separated_root(t1 * inverse, t2 * inverse, t3 * inverse);
  return {forward ? r : one, forward ? 1 - k * r : r};
}

/// Masks that select the largest of three values.
template <class Lanes>
struct LaneChoice {
  core::LaneInts<Lanes> first, second;  // both false: the third
};
template <class Lanes>
LIBOCC_INLINE LaneChoice<Lanes> select_max(const Lanes& a, const Lanes& b, const Lanes& c) {
  const core::LaneInts<Lanes> first = (a >= b) & (a >= c);
  return {first, ~first & (b >= c)};
}
template <class Lanes>
LIBOCC_INLINE Lanes chosen(const LaneChoice<Lanes>& i, const Lanes& a, const Lanes& b,
                           const Lanes& c) {
  return i.first ? a : (i.second ? b : c);
}

/// Computes the two lines of a degenerate conic. A complex pair is replaced by the nearest double
/// line.
template <class Lanes>
LIBOCC_INLINE void split(const LaneConic<Lanes>& c, core::LaneVector<Lanes>& first,
                         core::LaneVector<Lanes>& second) {
  const LaneConic<Lanes> adj = adjugate(c);
  const LaneChoice<Lanes> i = select_max(-adj.uu, -adj.vv, -adj.ww);
  const Lanes square = -chosen(i, adj.uu, adj.vv, adj.ww);
  const Lanes inverse = square > 0 ? core::inverse_root(square) : Lanes{};
  const core::LaneVector<Lanes> v{chosen(i, adj.uu, adj.uv, adj.uw) * inverse,
                                  chosen(i, adj.uv, adj.vv, adj.vw) * inverse,
                                  chosen(i, adj.uw, adj.vw, adj.ww) * inverse};
  const core::LaneVector<Lanes> row0{c.uu, c.uv - v.z, c.uw + v.y},
      row1{c.uv + v.z, c.vv, c.vw - v.x}, row2{c.uw - v.y, c.vw + v.x, c.ww};
  const auto size = [](const Lanes& a, const Lanes& b, const Lanes& d) LIBOCC_LAMBDA_INLINE {
    return core::absolute(a) + core::absolute(b) + core::absolute(d);
  };
  const LaneChoice<Lanes> row = select_max(
      size(row0.x, row0.y, row0.z), size(row1.x, row1.y, row1.z), size(row2.x, row2.y, row2.z));
  const LaneChoice<Lanes> column = select_max(
      size(row0.x, row1.x, row2.x), size(row0.y, row1.y, row2.y), size(row0.z, row1.z, row2.z));
  first = {chosen(row, row0.x, row1.x, row2.x), chosen(row, row0.y, row1.y, row2.y),
           chosen(row, row0.z, row1.z, row2.z)};
  second = {chosen(column, row0.x, row0.y, row0.z), chosen(column, row1.x, row1.y, row1.z),
            chosen(column, row2.x, row2.y, row2.z)};
}

/// Computes the two intersections of a conic and a line, up to scale. A complex pair is replaced by
/// its real part, twice.
template <class Lanes>
LIBOCC_INLINE void intersect(const LaneConic<Lanes>& c, const core::LaneVector<Lanes>& l,
                             core::LaneVector<Lanes> points[2]) {
  const LaneChoice<Lanes> i =
      select_max(core::absolute(l.x), core::absolute(l.y), core::absolute(l.z));
  const Lanes ii = chosen(i, c.uu, c.vv, c.ww), jj = chosen(i, c.vv, c.ww, c.uu),
              kk = chosen(i, c.ww, c.uu, c.vv);
  const Lanes ij = chosen(i, c.uv, c.vw, c.uw), ik = chosen(i, c.uw, c.uv, c.vw),
              jk = chosen(i, c.vw, c.uw, c.uv);
  const Lanes inverse = -1 / chosen(i, l.x, l.y, l.z);
  const Lanes y = chosen(i, l.y, l.z, l.x) * inverse, z = chosen(i, l.z, l.x, l.y) * inverse;
  const Lanes a = jj + y * (2 * ij + y * ii), g = kk + z * (2 * ik + z * ii);
  const Lanes b = jk + z * ij + y * (ik + z * ii);
  const Lanes square = b * b - a * g;
  const Lanes r = core::root(square);
  const Lanes q = b > 0 ? -(b + r) : r - b;
  const Lanes s[2] = {q, g}, t[2] = {a, q};
  for (int n = 0; n < 2; ++n) {
    const Lanes e = y * s[n] + z * t[n];
    points[n] = {chosen(i, e, t[n], s[n]), chosen(i, s[n], e, t[n]), chosen(i, t[n], s[n], e)};
  }
}

/// Partial derivatives of the three distance equations, and the cofactors of their Jacobian.
template <class Lanes>
struct LaneJacobian {
  Lanes a0, a1, b0, b2, g1, g2;

  LIBOCC_INLINE LaneJacobian(const Chords2& c, const Lanes& d0, const Lanes& d1, const Lanes& d2)
      : a0(2 * (d0 - d1) + d1 * c.c01),
        a1(2 * (d1 - d0) + d0 * c.c01),
        b0(2 * (d0 - d2) + d2 * c.c02),
        b2(2 * (d2 - d0) + d0 * c.c02),
        g1(2 * (d1 - d2) + d2 * c.c12),
        g2(2 * (d2 - d1) + d1 * c.c12) {}

  LIBOCC_INLINE Lanes inverse_determinant() const {
    const Lanes det = -(a0 * b2 * g1 + a1 * b0 * g2);
    return core::absolute(det) > 1e-12F ? 1 / det : Lanes{};
  }
  /// Change of the distances that changes equation 01, 02 or 12 alone, by the determinant.
  LIBOCC_INLINE core::LaneVector<Lanes> by01() const { return {-(b2 * g1), -(b0 * g2), b0 * g1}; }
  LIBOCC_INLINE core::LaneVector<Lanes> by02() const { return {-(a1 * g2), a0 * g2, -(a0 * g1)}; }
  LIBOCC_INLINE core::LaneVector<Lanes> by12() const { return {a1 * b2, -(a0 * b2), -(a1 * b0)}; }
};

/// Residuals of the three distance equations.
template <class Lanes>
LIBOCC_INLINE core::LaneVector<Lanes> off_sides(const Chords2& c, const LaneSides2<Lanes>& s,
                                                const core::LaneVector<Lanes>& d) {
  const Lanes e01 = d.x - d.y, e02 = d.x - d.z, e12 = d.y - d.z;
  return {e01 * e01 + d.x * d.y * c.c01 - s.s01, e02 * e02 + d.x * d.z * c.c02 - s.s02,
          e12 * e12 + d.y * d.z * c.c12 - s.s12};
}

template <class Lanes>
LIBOCC_INLINE Lanes sum_of_sizes(const core::LaneVector<Lanes>& v) {
  return core::absolute(v.x) + core::absolute(v.y) + core::absolute(v.z);
}

/// Performs one step of Newton's method if it reduces the residuals; the real part of a complex
/// pair stays. Returns the sum of the absolute residuals.
template <class Lanes>
LIBOCC_INLINE Lanes improve(const Chords2& c, const LaneSides2<Lanes>& s,
                            core::LaneVector<Lanes>& d) {
  const LaneJacobian<Lanes> j(c, d.x, d.y, d.z);
  const core::LaneVector<Lanes> off = off_sides(c, s, d);
  const core::LaneVector<Lanes> f = j.inverse_determinant() * off;
  const core::LaneVector<Lanes> moved = d - (f.x * j.by01() + (f.y * j.by02() + f.z * j.by12()));
  const Lanes before = sum_of_sizes(off), after = sum_of_sizes(off_sides(c, s, moved));
  const core::LaneInts<Lanes> better = after < before;
  d = {better ? moved.x : d.x, better ? moved.y : d.y, better ? moved.z : d.z};
  return better ? after : before;
}

/// Computes up to four sets of distances. The sides are squared and scaled to a sum of 1.
template <class Lanes>
LIBOCC_INLINE void solve_depths(const Chords2& c, const LaneSides2<Lanes>& s,
                                LaneDepths<Lanes> out[4]) {
  constexpr float by_noise = 0.05F;  // residual accepted where noise makes a double root complex
  const float k2 = c.c01 + c.c02 + c.c12, k = __builtin_sqrtf(k2), half = 0.5F / k;
  const float uv = 0.5F * c.c01 - 1, uw = (c.c01 + c.c02) * half, vw = (c.c01 + c.c12) * half;
  const LaneConic<Lanes> a{
      1 - 2 * s.s02, -2 * s.s02, c.c02 / k2 - s.s02, -uv * s.s02, c.c02 * half - uw * s.s02,
      -vw * s.s02};
  const LaneConic<Lanes> b{-2 * s.s12,  1 - 2 * s.s12, c.c12 / k2 - s.s12,
                           -uv * s.s12, -uw * s.s12,   c.c12 * half - vw * s.s12};
  const LaneMember<Lanes> m = degenerate_member(a, b);
  core::LaneVector<Lanes> lines[2];
  split<Lanes>(combined(m.x, a, m.y, b), lines[0], lines[1]);
  const LaneConic<Lanes> other = combined(-m.y, a, m.x, b);
  for (int line = 0; line < 2; ++line) {
    core::LaneVector<Lanes> points[2];
    intersect(other, lines[line], points);
    for (int n = 0; n < 2; ++n) {
      const core::LaneVector<Lanes>& p = points[n];
      const Lanes sum =
          2 * (p.x * p.x + p.y * p.y + uv * p.x * p.y + (uw * p.x + vw * p.y) * p.z) + p.z * p.z;
      const Lanes size = core::inverse_root(sum > 0 ? sum : Lanes{} + 1);
      const Lanes scale = p.z > 0 ? size : -size;
      const Lanes w = p.z * scale * (1 / k);
      core::LaneVector<Lanes> d{p.x * scale + w, p.y * scale + w, w};
      improve(c, s, d);
      const core::LaneInts<Lanes> fits = improve(c, s, d) < by_noise;
      out[2 * line + n] = {d.x, d.y, d.z, fits & (d.x > 0) & (d.y > 0) & (d.z > 0) & (sum > 0)};
    }
  }
}

}  // namespace occ::internal::identify
