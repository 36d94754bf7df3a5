// SPDX-License-Identifier: Apache-2.0
// Scores candidate poses of blob triples whose triangle has the same shape as a triangle of lamps
// (lamp_table.hpp). Gravity must be known, and the lamps must hang at one height.
//
// Each bearing is intersected with a horizontal plane at unit distance above the camera. There the
// blobs are a similar image of the map: position_map = shift + scale * position_blob, with complex
// numbers. |scale| is the height of the lamps above the camera, arg(scale) the heading.
#pragma once

#include <array>
#include <vector>

#include "libocc/identify/internal/hypothesis_voting.hpp"
#include "libocc/identify/internal/lamp_table.hpp"
#include "libocc/identify/internal/prior_gate.hpp"

namespace occ::internal::identify {

class ShapeVoting {
 public:
  ShapeVoting(const AssignmentProblem& problem, const LampTable& table);

  /// Appends all poses of three blobs with at least `min_inliers` inliers, in a fixed order.
  void score_triples(const std::array<int, 3>& observations, int min_inliers,
                     std::vector<ScoredPose>& candidates);

  const VoteStatistics& statistics() const { return statistics_; }
  /// True if the map has more lamps than the neighbours that form triangles.
  bool neighbours_truncated() const;

 private:
  /// A blob in the plane at unit distance above the camera, or below it (with reversed rays).
  struct LevelledBlob {
    Complex at;
    std::array<Complex, 2> tilted;  ///< for gravity off by its sigma, about two axes
    double sigma = 0;               ///< standard deviation in the plane
    int side = 0;                   ///< 1 above, -1 below, 0 too close to the horizon
  };
  struct LevelledTriple;

  double shape_error(const std::array<const LevelledBlob*, 3>& corners) const;
  double position_error(const LevelledTriple& triple, int observation) const;
  void score(const LevelledTriple& triple, const std::array<int, 3>& lamps, int min_inliers,
             std::vector<ScoredPose>& candidates);

  const AssignmentProblem& problem_;
  const LampTable& table_;
  Eigen::Matrix3d cam_from_upright_;
  PriorGate gate_;
  double image_area_ = 0;  // in the plane at unit distance, for a level camera
  std::vector<LevelledBlob> levelled_;
  VoteStatistics statistics_;
};

}  // namespace occ::internal::identify
