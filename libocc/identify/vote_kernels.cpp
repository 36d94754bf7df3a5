// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/vote_kernels.hpp"

namespace occ::internal::identify {

using namespace internal::core;

namespace {

template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> places_at(const float* const from[3], int i) {
  return {lanes_at<Lanes>(from[0] + i), lanes_at<Lanes>(from[1] + i), lanes_at<Lanes>(from[2] + i)};
}

/// Coefficients of a vector in the frame of b, c and n = b x c, times |n|^2.
template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> in_dual_frame(const LaneVector<Lanes>& n,
                                              const LaneVector<Lanes>& b,
                                              const LaneVector<Lanes>& c, const float* v) {
  return {dot(cross(c, n), v), dot(cross(n, b), v), dot(n, v)};
}

/// Whether the camera is on the first lamp's lit side; distances d in units of `size`.
template <class Lanes>
LIBOCC_INLINE LaneInts<Lanes> shows_lit_side(const NamedTriples& blobs, const LaneVector<Lanes>& d,
                                             const Lanes& size, const LaneVector<Lanes>& lit) {
  const LaneVector<Lanes> first = scaled(d.x, blobs.bearing[0]);
  const LaneVector<Lanes> e1 = scaled(d.y, blobs.bearing[1]) - first;
  const LaneVector<Lanes> e2 = scaled(d.z, blobs.bearing[2]) - first;
  return lit.x * dot(e1, first) + lit.y * dot(e2, first) +
             size * lit.z * dot(cross(e1, e2), first) <
         blobs.first_lit_below;
}

template <Simd simd>
LIBOCC_INLINE void solve_triples_body(const NamedTriples& blobs, const Places& places, int count,
                                      const Depths& out) {
  using Lanes = typename LanesOf<simd>::Type;
  for (int i = 0; i < count; i += lane_count<Lanes>) {
    const LaneVector<Lanes> b = places_at<Lanes>(places.second, i),
                            c = places_at<Lanes>(places.third, i);
    const LaneVector<Lanes> bc = c - b;
    LaneSides2<Lanes> sides{dot(b, b), dot(c, c), dot(bc, bc)};
    const Lanes sum = sides.s01 + sides.s02 + sides.s12;
    const Lanes inverse_size = inverse_root(sum), size = sum * inverse_size;
    const Lanes inverse = inverse_size * inverse_size;
    sides = {sides.s01 * inverse, sides.s02 * inverse, sides.s12 * inverse};
    const LaneVector<Lanes> n = cross(b, c);
    const LaneVector<Lanes> lit = in_dual_frame(n, b, c, blobs.first_normal);
    LaneDepths<Lanes> roots[4];
    solve_depths(blobs.chords, sides, roots);
    for (int k = 0; k < 4; ++k) {
      const int to = k * count + i;
      store_lanes(roots[k].d0 * size, out.depth[0] + to);
      store_lanes(roots[k].d1 * size, out.depth[1] + to);
      store_lanes(roots[k].d2 * size, out.depth[2] + to);
      const LaneVector<Lanes> d{roots[k].d0, roots[k].d1, roots[k].d2};
      store_lanes(roots[k].valid & shows_lit_side(blobs, d, size, lit), out.valid + to);
    }
  }
}
LIBOCC_MULTIVERSION(solve_triples,
                    (const NamedTriples& blobs, const Places& places, int count, const Depths& out),
                    (blobs, places, count, out))

/// x = origin + columns X of a lamp at X about the first one.
template <class Lanes>
struct LanePose {
  LaneVector<Lanes> column[3], origin;

  LIBOCC_INLINE LaneVector<Lanes> turned(const float* v) const {
    const Lanes zero{};
    return (zero + v[0]) * column[0] + ((zero + v[1]) * column[1] + (zero + v[2]) * column[2]);
  }
};

/// How a pose from three blobs errs by one of their angles: dx = origin + columns X.
template <class Lanes>
struct LaneErrors {
  LanePose<Lanes> of[3];

  /// Squared, of the direction of x, times |x|^2.
  LIBOCC_INLINE Lanes across2(const float* place, const LaneVector<Lanes>& x,
                              const Lanes& inverse_x2) const {
    Lanes sum{};
    for (int k = 0; k < 3; ++k) {
      const LaneVector<Lanes> dx = of[k].origin + of[k].turned(place);
      const Lanes along = dot(dx, x);
      sum += dot(dx, dx) - along * along * inverse_x2;
    }
    return sum > 0 ? sum : Lanes{};
  }
};

template <class Lanes>
struct NoErrors {
  LIBOCC_INLINE Lanes across2(const float*, const LaneVector<Lanes>&, const Lanes&) const {
    return Lanes{};
  }
};

template <class Lanes>
LIBOCC_INLINE LaneInts<Lanes> in_view(const Frustum& f, const LaneVector<Lanes>& x) {
  if (f.everywhere) return LaneInts<Lanes>{} == 0;
  return (x.z > 0) & (x.x > f.left * x.z) & (x.x < f.right * x.z) & (x.y > f.top * x.z) &
         (x.y < f.bottom * x.z);
}

constexpr int max_others = 64;

template <class Lanes, class Errors>
LIBOCC_INLINE void judge(const LanePose<Lanes>& pose, const Errors& errors, const Jury& jury,
                         const LaneInts<Lanes>& second, const LaneInts<Lanes>& third, int* further,
                         int* visible) {
  LaneInts<Lanes> hit[max_others];
  for (int s = 0; s < jury.other_count; ++s) hit[s] = LaneInts<Lanes>{};
  LaneInts<Lanes> seen{};
  const unsigned char* may_be = jury.may_be;
  for (int t = 0; t < jury.lamp_count; ++t, may_be += jury.other_count) {
    const NearLamp& lamp = jury.lamps[t];
    const LaneVector<Lanes> x = pose.origin + pose.turned(lamp.place);
    const LaneInts<Lanes> lit =
        (dot(pose.turned(lamp.normal), x) < lamp.lit_below) & (second != t) & (third != t);
    LaneVector<Lanes> in_cam = x;
    if (jury.to_camera) {
      const float* r = jury.to_camera;
      in_cam = {dot(x, r), dot(x, r + 3), dot(x, r + 6)};
    }
    seen -= lit & in_view(jury.frustum, in_cam);
    const Lanes x2 = dot(x, x), inverse_x2 = 1 / x2;
    const Lanes error2 =
        errors.across2(lamp.place, x, inverse_x2) + lamp.blur * lamp.blur * inverse_x2;
    for (int s = 0; s < jury.other_count; ++s) {
      if (!may_be[s]) continue;
      const Other& other = jury.others[s];
      const LaneVector<Lanes> across = cross(x, other.bearing);
      hit[s] |= lit & (dot(x, other.bearing) > 0) &
                (dot(across, across) < jury.gate2 * (x2 * other.sigma2 + error2));
    }
  }
  LaneInts<Lanes> count{};
  for (int s = 0; s < jury.other_count; ++s) count -= hit[s];
  store_lanes(count, further);
  store_lanes(seen, visible);
}

/// From the frame of the edges e1, e2 and their cross product.
template <class Lanes>
LIBOCC_INLINE LanePose<Lanes> from_edges(const LaneVector<Lanes>& origin,
                                         const LaneVector<Lanes>& e1, const LaneVector<Lanes>& e2,
                                         const LaneVector<Lanes>& normal,
                                         const LaneVector<Lanes> dual[3]) {
  const auto column = [&](const Lanes& a, const Lanes& b, const Lanes& c)
                          LIBOCC_LAMBDA_INLINE { return a * e1 + (b * e2 + c * normal); };
  LanePose<Lanes> pose;
  pose.column[0] = column(dual[0].x, dual[1].x, dual[2].x);
  pose.column[1] = column(dual[0].y, dual[1].y, dual[2].y);
  pose.column[2] = column(dual[0].z, dual[1].z, dual[2].z);
  pose.origin = origin;
  return pose;
}

template <Simd simd>
LIBOCC_INLINE void judge_triples_body(const NamedTriples& blobs, const Jury& jury,
                                      const Judged& poses, int count, const Verdicts& out) {
  using Lanes = typename LanesOf<simd>::Type;
  for (int i = 0; i < count; i += lane_count<Lanes>) {
    const LaneVector<Lanes> b = places_at<Lanes>(poses.places.second, i),
                            c = places_at<Lanes>(poses.places.third, i);
    const LaneVector<Lanes> n = cross(b, c);
    const Lanes inverse = 1 / dot(n, n);
    const LaneVector<Lanes> dual[3] = {inverse * cross(c, n), inverse * cross(n, b), inverse * n};
    const LaneVector<Lanes> d = places_at<Lanes>(poses.parameter, i);
    const LaneVector<Lanes> origin = scaled(d.x, blobs.bearing[0]);
    const LaneVector<Lanes> e1 = scaled(d.y, blobs.bearing[1]) - origin;
    const LaneVector<Lanes> e2 = scaled(d.z, blobs.bearing[2]) - origin;
    const LanePose<Lanes> pose = from_edges(origin, e1, e2, cross(e1, e2), dual);
    const LaneJacobian<Lanes> j(blobs.chords, d.x, d.y, d.z);
    const Lanes by_det = j.inverse_determinant();
    const LaneVector<Lanes> by[3] = {j.by01(), j.by02(), j.by12()};
    const Lanes products[3] = {d.x * d.y, d.x * d.z, d.y * d.z};
    const float chords[3] = {blobs.chords.c01, blobs.chords.c02, blobs.chords.c12};
    LaneErrors<Lanes> errors;
    for (int k = 0; k < 3; ++k) {
      // An angle's change moves its squared chord by 2 chords.
      const float change = 2 * __builtin_sqrtf(chords[k] * blobs.noise2[k]);
      const LaneVector<Lanes> dd = (by_det * products[k] * change) * by[k];
      const LaneVector<Lanes> moved = scaled(dd.x, blobs.bearing[0]);
      const LaneVector<Lanes> de1 = scaled(dd.y, blobs.bearing[1]) - moved;
      const LaneVector<Lanes> de2 = scaled(dd.z, blobs.bearing[2]) - moved;
      errors.of[k] = from_edges(moved, de1, de2, cross(de1, e2) + cross(e1, de2), dual);
    }
    judge(pose, errors, jury, lanes_at<LaneInts<Lanes>>(poses.second + i),
          lanes_at<LaneInts<Lanes>>(poses.third + i), out.further + i, out.visible + i);
  }
}
LIBOCC_MULTIVERSION(judge_triples,
                    (const NamedTriples& blobs, const Jury& jury, const Judged& poses, int count,
                     const Verdicts& out),
                    (blobs, jury, poses, count, out))

template <Simd simd>
LIBOCC_INLINE void judge_pairs_body(const float* first_bearing, const Jury& jury,
                                    const Judged& poses, int count, const Verdicts& out) {
  using Lanes = typename LanesOf<simd>::Type;
  for (int i = 0; i < count; i += lane_count<Lanes>) {
    const LaneVector<Lanes> p = places_at<Lanes>(poses.parameter, i);
    const Lanes zero{}, one = 1 + zero;
    LanePose<Lanes> pose;
    pose.column[0] = {p.y, p.z, zero};
    pose.column[1] = {-p.z, p.y, zero};
    pose.column[2] = {zero, zero, one};
    pose.origin = scaled(p.x, first_bearing);
    judge(pose, NoErrors<Lanes>{}, jury, lanes_at<LaneInts<Lanes>>(poses.second + i),
          lanes_at<LaneInts<Lanes>>(poses.third + i), out.further + i, out.visible + i);
  }
}
LIBOCC_MULTIVERSION(judge_pairs,
                    (const float* first_bearing, const Jury& jury, const Judged& poses, int count,
                     const Verdicts& out),
                    (first_bearing, jury, poses, count, out))

}  // namespace

SolveTriples solve_triples_for_cpu(Simd simd) { return solve_triples_for(simd); }
JudgeTriples judge_triples_for_cpu(Simd simd) { return judge_triples_for(simd); }
JudgePairs judge_pairs_for_cpu(Simd simd) { return judge_pairs_for(simd); }

}  // namespace occ::internal::identify
