// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/vote_kernels.hpp"

namespace occ::internal::identify {

using namespace internal::core;

namespace {

template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> positions_at(const float* const from[3], int i) {
  return {lanes_at<Lanes>(from[0] + i), lanes_at<Lanes>(from[1] + i), lanes_at<Lanes>(from[2] + i)};
}

/// Coefficients of a vector in the frame of b, c and n = b x c, times |n|^2.
template <class Lanes>
LIBOCC_INLINE LaneVector<Lanes> in_dual_frame(const LaneVector<Lanes>& n,
                                              const LaneVector<Lanes>& b,
                                              const LaneVector<Lanes>& c, const float* v) {
  return {dot(cross(c, n), v), dot(cross(n, b), v), dot(n, v)};
}

/// True if the camera is on the lit side of the first lamp; distances d in units of `size`.
template <class Lanes>
LIBOCC_INLINE LaneInts<Lanes> shows_lit_side(const TripleInput& blobs, const LaneVector<Lanes>& d,
                                             const Lanes& size, const LaneVector<Lanes>& lit) {
  const LaneVector<Lanes> first = scaled(d.x, blobs.bearing[0]);
  const LaneVector<Lanes> e1 = scaled(d.y, blobs.bearing[1]) - first;
  const LaneVector<Lanes> e2 = scaled(d.z, blobs.bearing[2]) - first;
  return lit.x * dot(e1, first) + lit.y * dot(e2, first) +
             size * lit.z * dot(cross(e1, e2), first) <
         blobs.first_lit_below;
}

template <Simd simd>
LIBOCC_INLINE void solve_triples_body(const TripleInput& blobs, const LampPositions& positions,
                                      int count, const DepthSolutions& out) {
  using Lanes = typename LanesOf<simd>::Type;
  for (int i = 0; i < count; i += lane_count<Lanes>) {
    const LaneVector<Lanes> b = positions_at<Lanes>(positions.second, i),
                            c = positions_at<Lanes>(positions.third, i);
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
                    (const TripleInput& blobs, const LampPositions& positions, int count,
                     const DepthSolutions& out),
                    (blobs, positions, count, out))

/// Pose in the camera frame: x = origin + columns X for a lamp at X relative to the first lamp.
template <class Lanes>
struct LanePose {
  LaneVector<Lanes> column[3], origin;

  LIBOCC_INLINE LaneVector<Lanes> rotate(const float* v) const {
    const Lanes zero{};
    return (zero + v[0]) * column[0] + ((zero + v[1]) * column[1] + (zero + v[2]) * column[2]);
  }
};

/// Derivatives of a pose by the three angles between the bearings, times their standard deviations:
/// dx = origin + columns X.
template <class Lanes>
struct LanePoseError {
  LanePose<Lanes> of[3];

  /// Variance of the direction of x, times |x|^2.
  LIBOCC_INLINE Lanes across2(const float* position, const LaneVector<Lanes>& x,
                              const Lanes& inverse_x2) const {
    Lanes sum{};
    for (int k = 0; k < 3; ++k) {
      const LaneVector<Lanes> dx = of[k].origin + of[k].rotate(position);
      const Lanes along = dot(dx, x);
      sum += dot(dx, dx) - along * along * inverse_x2;
    }
    return sum > 0 ? sum : Lanes{};
  }
};

template <class Lanes>
struct NoPoseError {
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

constexpr int max_remaining = 64;

template <class Lanes, class Errors>
LIBOCC_INLINE void score(const LanePose<Lanes>& pose, const Errors& errors,
                         const ScoringInput& input, const LaneInts<Lanes>& second,
                         const LaneInts<Lanes>& third, int* inliers, int* visible) {
  LaneInts<Lanes> hit[max_remaining];
  for (int s = 0; s < input.remaining_count; ++s) hit[s] = LaneInts<Lanes>{};
  LaneInts<Lanes> in_image{};
  const unsigned char* allowed = input.allowed;
  for (int t = 0; t < input.lamp_count; ++t, allowed += input.remaining_count) {
    const NearLamp& lamp = input.lamps[t];
    const LaneVector<Lanes> x = pose.origin + pose.rotate(lamp.position);
    const LaneInts<Lanes> lit =
        (dot(pose.rotate(lamp.normal), x) < lamp.lit_below) & (second != t) & (third != t);
    LaneVector<Lanes> in_cam = x;
    if (input.to_camera) {
      const float* r = input.to_camera;
      in_cam = {dot(x, r), dot(x, r + 3), dot(x, r + 6)};
    }
    in_image -= lit & in_view(input.frustum, in_cam);
    const Lanes x2 = dot(x, x), inverse_x2 = 1 / x2;
    const Lanes error2 =
        errors.across2(lamp.position, x, inverse_x2) + lamp.blur * lamp.blur * inverse_x2;
    for (int s = 0; s < input.remaining_count; ++s) {
      if (!allowed[s]) continue;
      const RemainingBlob& blob = input.remaining[s];
      const LaneVector<Lanes> across = cross(x, blob.bearing);
      hit[s] |= lit & (dot(x, blob.bearing) > 0) &
                (dot(across, across) < input.gate2 * (x2 * blob.sigma2 + error2));
    }
  }
  LaneInts<Lanes> count{};
  for (int s = 0; s < input.remaining_count; ++s) count -= hit[s];
  store_lanes(count, inliers);
  store_lanes(in_image, visible);
}

/// Pose from the edges e1, e2 in the camera frame, their cross product, and the dual frame in the
/// map.
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
LIBOCC_INLINE void score_triples_body(const TripleInput& blobs, const ScoringInput& input,
                                      const PoseBatch& poses, int count, const Scores& out) {
  using Lanes = typename LanesOf<simd>::Type;
  for (int i = 0; i < count; i += lane_count<Lanes>) {
    const LaneVector<Lanes> b = positions_at<Lanes>(poses.positions.second, i),
                            c = positions_at<Lanes>(poses.positions.third, i);
    const LaneVector<Lanes> n = cross(b, c);
    const Lanes inverse = 1 / dot(n, n);
    const LaneVector<Lanes> dual[3] = {inverse * cross(c, n), inverse * cross(n, b), inverse * n};
    const LaneVector<Lanes> d = positions_at<Lanes>(poses.parameter, i);
    const LaneVector<Lanes> origin = scaled(d.x, blobs.bearing[0]);
    const LaneVector<Lanes> e1 = scaled(d.y, blobs.bearing[1]) - origin;
    const LaneVector<Lanes> e2 = scaled(d.z, blobs.bearing[2]) - origin;
    const LanePose<Lanes> pose = from_edges(origin, e1, e2, cross(e1, e2), dual);
    const LaneJacobian<Lanes> j(blobs.chords, d.x, d.y, d.z);
    const Lanes by_det = j.inverse_determinant();
    const LaneVector<Lanes> by[3] = {j.by01(), j.by02(), j.by12()};
    const Lanes products[3] = {d.x * d.y, d.x * d.z, d.y * d.z};
    const float chords[3] = {blobs.chords.c01, blobs.chords.c02, blobs.chords.c12};
    LanePoseError<Lanes> errors;
    for (int k = 0; k < 3; ++k) {
      // A change of an angle changes its squared chord by 2 chord times that change.
      const float change = 2 * __builtin_sqrtf(chords[k] * blobs.noise2[k]);
      const LaneVector<Lanes> dd = (by_det * products[k] * change) * by[k];
      const LaneVector<Lanes> moved = scaled(dd.x, blobs.bearing[0]);
      const LaneVector<Lanes> de1 = scaled(dd.y, blobs.bearing[1]) - moved;
      const LaneVector<Lanes> de2 = scaled(dd.z, blobs.bearing[2]) - moved;
      errors.of[k] = from_edges(moved, de1, de2, cross(de1, e2) + cross(e1, de2), dual);
    }
    score(pose, errors, input, lanes_at<LaneInts<Lanes>>(poses.second + i),
          lanes_at<LaneInts<Lanes>>(poses.third + i), out.inliers + i, out.visible + i);
  }
}
LIBOCC_MULTIVERSION(score_triples,
                    (const TripleInput& blobs, const ScoringInput& input, const PoseBatch& poses,
                     int count, const Scores& out),
                    (blobs, input, poses, count, out))

template <Simd simd>
LIBOCC_INLINE void score_pairs_body(const float* first_bearing, const ScoringInput& input,
                                    const PoseBatch& poses, int count, const Scores& out) {
  using Lanes = typename LanesOf<simd>::Type;
  for (int i = 0; i < count; i += lane_count<Lanes>) {
    const LaneVector<Lanes> p = positions_at<Lanes>(poses.parameter, i);
    const Lanes zero{}, one = 1 + zero;
    LanePose<Lanes> pose;
    pose.column[0] = {p.y, p.z, zero};
    pose.column[1] = {-p.z, p.y, zero};
    pose.column[2] = {zero, zero, one};
    pose.origin = scaled(p.x, first_bearing);
    score(pose, NoPoseError<Lanes>{}, input, lanes_at<LaneInts<Lanes>>(poses.second + i),
          lanes_at<LaneInts<Lanes>>(poses.third + i), out.inliers + i, out.visible + i);
  }
}
LIBOCC_MULTIVERSION(score_pairs,
                    (const float* first_bearing, const ScoringInput& input, const PoseBatch& poses,
                     int count, const Scores& out),
                    (first_bearing, input, poses, count, out))

}  // namespace

SolveTriples solve_triples_for_cpu(Simd simd) { return solve_triples_for(simd); }
ScoreTriples score_triples_for_cpu(Simd simd) { return score_triples_for(simd); }
ScorePairs score_pairs_for_cpu(Simd simd) { return score_pairs_for(simd); }

}  // namespace occ::internal::identify
