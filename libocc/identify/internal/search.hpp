// SPDX-License-Identifier: Apache-2.0
// Search for all pose hypotheses with nearly the largest support, by one of the methods of
// IdentifyMethod.
#pragma once

#include <functional>
#include <string>

#include "libocc/identify/internal/covisibility.hpp"
#include "libocc/identify/internal/hypothesis_voting.hpp"
#include "libocc/identify/internal/outline_misfit.hpp"
#include "libocc/identify/internal/pose_hypothesis.hpp"
#include "libocc/identify/internal/size_consistency.hpp"
#include "libocc/identify/internal/triple_order.hpp"

namespace occ::internal::identify {

/// Maximum expected number of wrong poses of a hypothesis that ends the search: if it misses no
/// lamp, and if it misses some.
inline constexpr double max_chance = 0.1, max_chance_if_missing = 0.01;

/// Maximum expected number of wrong poses of a hypothesis that leaves blobs and ends the search.
inline constexpr double max_chance_if_leaving = 1e-6;

/// A hypothesis with this many pairs is very unlikely to be wrong, so fewer alternatives are tried.
inline constexpr int strong_pairs = 6;

/// Share of the image that the gate of one blob covers, with the error of a well-determined pose.
double gate_share(const AssignmentProblem& problem);

/// True if the camera sees the lit side of the three lamps and their sizes agree with the blobs.
bool appearance_agrees(const AssignmentProblem& problem, const Assignment& assignment,
                       const Rigid3& pose);

/// True if the blobs of the pairs may be reflections of lamps. A reflection in a plane shows the
/// mirror image of the map: the matched lamps are then one of other lamps.
bool may_match_reflections(const AssignmentProblem& problem, const PoseHypothesis& e);

/// A scoring function for groups of blobs: HypothesisVoting or ShapeVoting.
struct VotingMethod {
  bool neighbours_truncated = false;
  std::function<void(const std::array<int, 3>&, int min_inliers, std::vector<ScoredPose>&)> score;
  std::function<const VoteStatistics&()> statistics;
};

class Search {
 public:
  explicit Search(const AssignmentProblem& problem);

  void run();

  /// Hypotheses by increasing chi-square, which contains a penalty for each pair less than the
  /// largest support. A sixth of the pairs may be fewer. If the best has three coded pairs and one
  /// uncoded pair, those with the three coded pairs are included, because the fourth pair may be
  /// accidental.
  const std::vector<PoseHypothesis>& found() const { return found_; }
  /// Expected number of wrong hypotheses with as many pairs as the best one.
  double chance() const;
  int tried() const { return tried_; }  ///< assignments of three blobs
  /// True if the search stopped at max_hypotheses or at the deadline.
  bool cut_short() const { return cut_short_ || !limit_elsewhere_.empty(); }
  std::string limit_reached() const;  ///< message of a search that was cut short
  /// Share of the groups of blobs left out; 0 unless the search with the prior was cut short.
  double untried() const;
  /// Poses that only the prior excludes, see Identification::excluded.
  const std::vector<PoseHypothesis>& excluded() const { return excluded_; }
  bool excluded_listed() const { return excluded_listed_; }

 private:
  /// A pose from three pairs, with the pairs that agree with it before any refit.
  struct Seed {
    Assignment assignment;
    int further = 0;  // pairs besides the assignment
    int coded = 0;    // coded pairs, the assignment included
  };

  void search_by(IdentifyMethod method);
  bool search_near_last_pose();
  bool search_lamp_like(IdentifyMethod method);
  void search_by_pairs();
  void try_pair(const Pair& first, const Pair& second);
  bool extend_last_pose(const AssignmentProblem& near);
  void adopt(Search&& other);
  void add_moved_poses(bool list_excluded);
  void add_poses_elsewhere();
  void search_by_alignment();
  void add_row();
  void try_triple(const BlobTriple& triple);
  void search_by_sampling();
  void search_by_clustering();
  void search_by_voting();
  void search_by_hashing();
  void run_voting(const VotingMethod& method);
  void vote_by_levels(const VotingMethod& method, TripleOrder& order, int distant_outliers);
  int group_size() const;
  int cost() const;
  bool reached_limit() const;
  bool tried_enough() const;
  void verify_best(WaitingPoses& candidates, int min_inliers);
  void consider(const ScoredPose& candidate);
  bool is_duplicate(const ScoredPose& candidate) const;
  double chance_of(const PoseHypothesis& e) const;
  double chance_of_prior(const std::vector<Pair>& best) const;
  bool misses_too_many(const PoseHypothesis& e) const;
  bool fits(const PoseHypothesis& e) const;
  std::vector<FittedPose> candidates_from(const Assignment& assignment) const;
  void consider(const FittedPose& seed, const Assignment& assignment);
  void keep(PoseHypothesis hypothesis);
  void merge_and_rank();
  bool contradicts_orientation(const Assignment& assignment) const;
  bool has_enough_support(const Assignment& assignment, const std::vector<Pair>& pairs) const;
  bool best_is_strong() const;
  bool enough_groups(int groups) const;
  int max_outliers() const;
  int coded_pairs(const std::vector<Pair>& pairs) const;
  int support(const std::vector<Pair>& pairs) const;
  int fewer_pairs() const;
  double chi2_of_pair() const;
  bool has_similar_support(const PoseHypothesis& e, const PoseHypothesis& most) const;
  void penalise_fewer_pairs();

  const AssignmentProblem& problem_;
  Covisibility covisibility_;
  SizeConsistency sizes_;
  OutlineMisfit outlines_;
  bool prior_ = false;
  std::vector<PoseHypothesis> found_;
  int best_support_ = 0;
  // A hypothesis of best_support_ leaves no blob, or misses no lamp and is not accidental.
  bool best_is_complete_ = false;
  int tried_ = 0;
  std::vector<Seed> seeds_;                   // those on the lit sides that agree with the prior
  std::vector<double> prior_chi2_of_seeds_;   // of all poses from three pairs
  bool row_ = false;                          // only lamps that are almost on a line are tried
  std::optional<VoteStatistics> statistics_;  // set by the methods that vote
  int groups_ = 0;                            // groups of blobs scored
  int verified_ = 0;                          // candidates verified in double precision
  bool by_shape_ = false, by_last_pose_ = false;
  int groups_in_all_ = 0;  // groups of blobs that could be tried
  std::vector<PoseHypothesis> excluded_;
  bool excluded_listed_ = false;
  bool cut_short_ = false;
  std::string limit_elsewhere_;  // message of a search without the prior that was cut short
};

}  // namespace occ::internal::identify
