// SPDX-License-Identifier: Apache-2.0
// Scores candidate poses by counting inliers (hypothesis voting).
//
// An assignment of three blobs to three lamps yields up to four poses (P3P); with known gravity,
// two blobs and two lamps yield up to two. The score of a pose is the number of remaining blobs
// that fall inside the gate of a projected lamp. Scores are computed in single precision, several
// assignments at a time (SIMD); gates propagate the blobs' covariances to first order. Only the
// best poses are verified in double precision.
//
// To bound the number of assignments, a lamp is combined with its nearest neighbours only. If a
// farther lamp were visible, the neighbours between would be visible as well.
#pragma once

#include <array>
#include <vector>

#include "libocc/identify/internal/covisibility.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/identify/internal/predicted_direction.hpp"
#include "libocc/identify/internal/prior_gate.hpp"
#include "libocc/identify/internal/size_consistency.hpp"
#include "libocc/identify/internal/vote_kernels.hpp"

namespace occ::internal::identify {

/// A candidate pose with its score.
struct ScoredPose {
  std::vector<Pair> assignment;  ///< three pairs, or two with known gravity
  Rigid3 pose;                   ///< camera from the local frame, relative error about 1e-4
  int inliers = 0;               ///< remaining blobs with a lamp in their gate
};

/// Scored poses that wait for their verification, by number of inliers.
class WaitingPoses {
 public:
  /// Moves all poses out of `scored`.
  void add(std::vector<ScoredPose>& scored);
  /// Removes and returns the poses with at least min_inliers, most inliers first; those with
  /// equally many in the order in which they were added.
  std::vector<ScoredPose> take(int min_inliers);

 private:
  std::vector<std::vector<ScoredPose>> by_inliers_;
};

/// Totals over all poses scored.
struct VoteStatistics {
  int assignments = 0;
  double poses = 0;    ///< poses from which the lit side of the first lamp is visible
  double visible = 0;  ///< lamps in view besides the assigned ones, summed over these poses
};

class HypothesisVoting {
 public:
  HypothesisVoting(const AssignmentProblem& problem, Covisibility& covisibility,
                   SizeConsistency& sizes);

  /// Appends all poses of three blobs with at least `min_inliers` inliers, in a fixed order.
  void score_triples(const std::array<int, 3>& observations, int min_inliers,
                     std::vector<ScoredPose>& candidates);
  /// Appends all poses of two blobs. The prior must contain gravity.
  void score_pairs(const std::array<int, 2>& observations, int min_inliers,
                   std::vector<ScoredPose>& candidates);

  const VoteStatistics& statistics() const { return statistics_; }
  /// True if the map has more lamps than the neighbours that are combined.
  bool neighbours_truncated() const;

 private:
  /// Distances of a lamp that the size of its blob permits, in units of unit_m_.
  struct Depths {
    float min = 0, max = 0;
    bool contain(double depth) const { return depth > min && depth < max; }
  };
  struct Neighbours {
    std::vector<int> map_points;  // nearest first
    std::vector<NearLamp> lamps;  // relative to the lamp whose neighbours they are
  };
  /// Assignments of two further blobs to neighbours of a first lamp, or poses that result from
  /// them.
  struct Table {
    std::array<std::vector<float>, 3> second_position, third_position;
    std::vector<int> second, third;
    void resize(std::size_t size);
    void copy(std::size_t from, const Table& other, std::size_t to);
    LampPositions positions() const;
  };

  ScoringInput scoring_input(int first, const std::vector<int>& observations,
                             const std::vector<RemainingBlob>& remaining);
  PoseBatch pose_batch() const;
  int image_orientation(const std::array<int, 3>& observations) const;
  void solve(const TripleInput& blobs, std::size_t assignments);
  std::size_t add_assignments(const std::array<int, 3>& observations, int first,
                              int image_orientation);
  void pad_poses(std::size_t count);
  Depths depths_of(int observation, int map_point) const;
  std::size_t add_poses(const std::array<int, 3>& observations, int first, std::size_t assignments);
  std::size_t add_headings(const std::array<int, 2>& observations, int first, const PriorGate& gate,
                           double relative);
  bool accept(std::size_t pose, int min_inliers);
  Rigid3 pose_of_triple(const std::array<int, 3>& observations,
                        const std::array<int, 3>& map_points, std::size_t pose) const;

  const AssignmentProblem& problem_;
  Covisibility& covisibility_;
  SizeConsistency& sizes_;
  Simd simd_;
  double unit_m_ = 1;  // unit of length of the single-precision numbers
  Frustum frustum_;
  std::size_t combined_ = 0;  // neighbours used in assignments; more of them are projected
  std::vector<Neighbours> neighbours_;
  Table assignments_, batch_;
  std::array<std::vector<float>, 3> depths_, parameters_;
  std::vector<int> valid_, inliers_, visible_;
  std::vector<Depths> second_depths_, third_depths_;  // by neighbour
  std::vector<char> third_permitted_;                 // likewise
  std::vector<unsigned char> allowed_;
  VoteStatistics statistics_;
};

}  // namespace occ::internal::identify
