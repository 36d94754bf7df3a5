// SPDX-License-Identifier: Apache-2.0
// Inner loops of hypothesis voting (hypothesis_voting.hpp), for several assignments at once.
// Lengths are in units of the map, positions are relative to the first lamp of the assignment.
#pragma once

#include <cstddef>

#include "libocc/core/simd.hpp"
#include "libocc/identify/internal/lane_p3p.hpp"

namespace occ::internal::identify {

/// A lamp in the neighbourhood of the first lamp.
struct NearLamp {
  float position[3], normal[3];
  float lit_below;  ///< the lit side is visible if normal . position < lit_below, camera frame
  float blur;       ///< radius^2; blur / distance bounds the offset of the image ellipse's centre
};

/// A blob outside the assignment.
struct RemainingBlob {
  float bearing[3];
  float sigma2;  ///< variance of the direction [rad^2], without that of the predicted direction
};

/// Field of view of a pinhole camera: bounds of x / z and y / z.
struct Frustum {
  float left, right, top, bottom;
  bool everywhere;  ///< wide-angle camera: every direction counts as in view
};

/// Data shared by all assignments with the same first lamp.
struct TripleInput {
  float bearing[3][3];
  Chords2 chords;
  float noise2[3];  ///< variances of the angles 01, 02, 12 [rad^2]
  float first_normal[3];
  float first_lit_below;
};

/// Positions of the second and third lamp: [coordinate][assignment]. Arrays are padded to a
/// multiple of max_lanes.
struct LampPositions {
  const float* second[3];
  const float* third[3];
};

/// Distances of three lamps for each assignment: up to four solutions, at index
/// assignment + solution * count. Valid if real and the camera is on the lit side of the first
/// lamp.
struct DepthSolutions {
  float* depth[3];
  int* valid;
};

/// Poses to score. Parameters of a triple are its three distances; parameters of a pair are the
/// distance of the first lamp and the cosine and sine of the heading.
struct PoseBatch {
  const float* parameter[3];
  LampPositions positions;  ///< triples only
  const int* second;        ///< index of the near lamp; -1 for padding
  const int* third;         ///< -1 for pairs
};

struct ScoringInput {
  const NearLamp* lamps;
  int lamp_count;
  const RemainingBlob* remaining;
  int remaining_count;
  const unsigned char* allowed;  ///< [lamp * remaining_count + blob]
  float gate2;                   ///< squared gate [sigma^2]
  Frustum frustum;
  const float* to_camera;  ///< rotation from the upright frame, row-major; null for triples
};

/// Results per pose: number of remaining blobs with a lamp in their gate, number of lamps in view.
struct Scores {
  int* inliers;
  int* visible;
};

using SolveTriples = void (*)(const TripleInput&, const LampPositions&, int count,
                              const DepthSolutions&);
using ScoreTriples = void (*)(const TripleInput&, const ScoringInput&, const PoseBatch&, int count,
                              const Scores&);
using ScorePairs = void (*)(const float* first_bearing, const ScoringInput&, const PoseBatch&,
                            int count, const Scores&);

SolveTriples solve_triples_for_cpu(Simd simd);
ScoreTriples score_triples_for_cpu(Simd simd);
ScorePairs score_pairs_for_cpu(Simd simd);

}  // namespace occ::internal::identify
