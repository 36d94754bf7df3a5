// SPDX-License-Identifier: Apache-2.0
// Internal: the hot loops of ballots (identify/internal/ballot.hpp), for several namings at once.
#pragma once

#include <cstddef>

#include "libocc/core/simd.hpp"
#include "libocc/identify/internal/lane_p3p.hpp"

namespace occ::internal::identify {

/// A lamp about the first of the naming, in units of the map.
struct NearLamp {
  float place[3], normal[3];
  float lit_below;  ///< it shows its lit side where normal . place, camera frame, is less
  float blur;  ///< radius^2: how far an ellipse's centre may be off the lamp's, times its distance
};

/// A blob that is not named.
struct Other {
  float bearing[3];
  float sigma2;  ///< [rad^2] of its direction, that of the predicted one not included
};

/// Where lamps must be to be in the image: bounds of x / z and y / z.
struct Frustum {
  float left, right, top, bottom;
  bool everywhere;  ///< a camera that may see behind itself: all directions count as in view
};

/// What all namings that share their first lamp have in common.
struct NamedTriples {
  float bearing[3][3];
  Chords2 chords;
  float noise2[3];  ///< [rad^2] of the angles 01, 02, 12
  float first_normal[3];
  float first_lit_below;
};

/// Places of the second and the third lamp about the first: lanes[coordinate][naming], to a
/// multiple of max_lanes.
struct Places {
  const float* second[3];
  const float* third[3];
};

/// Distances of three lamps for each naming: up to four sets each, at naming + set * count; valid
/// where they are real, and the camera is on the first lamp's lit side.
struct Depths {
  float* depth[3];
  int* valid;
};

/// Poses to judge: for three blobs by their distances, for two by the first one's distance and the
/// cosine and sine of the heading.
struct Judged {
  const float* parameter[3];
  Places places;      ///< three blobs
  const int* second;  ///< of the near lamps; -1 for padding
  const int* third;   ///< -1 for two blobs
};

struct Jury {
  const NearLamp* lamps;
  int lamp_count;
  const Other* others;
  int other_count;
  const unsigned char* may_be;  ///< [lamp * other_count + other]
  float gate2;
  Frustum frustum;
  const float* to_camera;  ///< rows; for two blobs: from the upright frame
};

/// For each pose: how many other blobs have a lamp in their gate, and how many lamps are in view.
struct Verdicts {
  int* further;
  int* visible;
};

using SolveTriples = void (*)(const NamedTriples&, const Places&, int count, const Depths&);
using JudgeTriples = void (*)(const NamedTriples&, const Jury&, const Judged&, int count,
                              const Verdicts&);
using JudgePairs = void (*)(const float* first_bearing, const Jury&, const Judged&, int count,
                            const Verdicts&);

SolveTriples solve_triples_for_cpu(Simd simd);
JudgeTriples judge_triples_for_cpu(Simd simd);
JudgePairs judge_pairs_for_cpu(Simd simd);

}  // namespace occ::internal::identify
