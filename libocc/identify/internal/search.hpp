// SPDX-License-Identifier: Apache-2.0
// Internal: all explanations of the blobs that explain as many of them as any does.
#pragma once

#include <functional>

#include "libocc/identify/internal/ballot.hpp"
#include "libocc/identify/internal/explain.hpp"
#include "libocc/identify/internal/seen_together.hpp"
#include "libocc/identify/internal/triples.hpp"

namespace occ::internal::identify {

/// Expected number of wrong poses that explain as much as one that is taken for the only one, when
/// it sees all lamps that it should see, and when it misses some.
inline constexpr double unlikely = 0.1, unlikely_if_missing = 0.01;

/// Pairs that hardly agree by chance.
inline constexpr int strong = 6;

double gate_share(const AssignmentProblem& problem);
bool looks_right(const AssignmentProblem& problem, const Naming& naming, const Rigid3& pose);

/// How groups of blobs are voted on.
struct Poll {
  bool neighbours_only = false;
  std::function<void(const std::array<int, 3>&, int least, std::vector<Vote>&)> cast;
  std::function<const Turnout&()> turnout;
};

class Search {
 public:
  explicit Search(const AssignmentProblem& problem);

  void run();

  /// Most pairs first, then the smallest chi-square. All pair as many blobs as the best one, or
  /// three that are named when the best adds but one unnamed blob: that may be an accident.
  const std::vector<PoseHypothesis>& found() const { return found_; }
  /// Explanations by accident that are to be expected to pair as many blobs as the best one.
  double chance() const;
  /// False for a best explanation by vote whose blobs are further off than their errors let expect.
  bool best_fits() const { return found_.empty() || !turnout_ || fits(found_.front()); }
  int tried() const { return tried_; }  ///< namings of three blobs
  bool cut_short() const { return cut_short_; }

 private:
  struct Seed {
    Naming naming;
    int further = 0;  // pairs found beyond these, before any fit
    int named = 0;    // of all these
  };

  void try_all();
  void try_triple(const BlobTriple& triple);
  void sample();
  void cluster();
  void vote();
  void hash();
  void vote_by_levels(const Poll& poll, TripleOrder& order, int far_apart);
  void run_poll(const Poll& poll);
  int named_by_vote() const;
  int spent() const;
  void elect(std::vector<Vote>& votes, int least);
  void consider(const Vote& vote);
  bool known(const Vote& vote) const;
  double chance_of(const PoseHypothesis& e) const;
  double chance_of_prior(const std::vector<Pair>& best) const;
  bool misses_too_much(const PoseHypothesis& e) const;
  bool fits(const PoseHypothesis& e) const;
  std::vector<FittedPose> seeds_of(const Naming& naming) const;
  void consider(const FittedPose& seed, const Naming& naming);
  void keep(PoseHypothesis explanation);
  void merge_and_rank();
  bool contradicts_view(const Naming& naming) const;
  bool worth_keeping(const Naming& naming, const std::vector<Pair>& pairs) const;
  int false_lights() const;
  int named_pairs(const std::vector<Pair>& pairs) const;
  int worth(const std::vector<Pair>& pairs) const;
  bool rivals(const PoseHypothesis& e) const;

  const AssignmentProblem& problem_;
  SeenTogether together_;
  bool prior_ = false;
  std::vector<PoseHypothesis> found_;
  int most_ = 0;  // the largest worth of an explanation so far
  int tried_ = 0;
  std::vector<Seed>
      seeds_;  // poses from three pairs that face their lamps and agree with the prior
  std::vector<double> prior_chi2_of_seeds_;  // of all poses from three pairs
  std::optional<Turnout> turnout_;           // of the vote so far
  int looks_ = 0;                            // at votes
  bool by_shape_ = false;
  bool cut_short_ = false;
};

}  // namespace occ::internal::identify
