// SPDX-License-Identifier: Apache-2.0
// Excludes assignments of two blobs to two discs by the sizes of the blobs.
//
// A measured rim limits the distance d of a disc of radius r to r / max_radius ... r / min_radius
// (assignment_problem.hpp). The distances of two discs and the angle t between their bearings
// determine their separation, sqrt(d1^2 + d2^2 - 2 d1 d2 cos t), which must contain that of the map
// within its range. Blobs without a measured size have no limits. A pose that contains an excluded
// pair contradicts a size, so it would be rejected after P3P as well.
#pragma once

#include <vector>

#include "libocc/core/math.hpp"
#include "libocc/identify/internal/pose_fit.hpp"

namespace occ::internal::identify {

struct DistanceRange {
  double low = 0, high = infinity;
};

/// Distances of a map point that the size of its blob permits [m]; without limits for a blob
/// without a measured size.
DistanceRange distances_m(const BearingObservation& observation, const MapPoint& map_point);

class LIBOCC_API SizeConsistency {
 public:
  explicit SizeConsistency(const AssignmentProblem& problem);

  /// True if the sizes permit both pairs. Results are stored.
  bool permits(const Pair& first, const Pair& second);

 private:
  bool compute(const Pair& first, const Pair& second) const;

  const AssignmentProblem& problem_;
  std::size_t blobs_ = 0, points_ = 0;
  std::vector<char> states_;  // 0 unknown, 1 permitted, 2 excluded; empty if no size is known
};

}  // namespace occ::internal::identify
