// SPDX-License-Identifier: Apache-2.0
// Order in which groups of three blobs (or two, where two determine a pose) are tried.
//
// All assignments of three true lights yield every pose that contains them. A hypothesis that
// leaves k blobs unmatched therefore ends the search as soon as no set of k blobs intersects every
// group tried: any other hypothesis of the same quality would contain one of these groups.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "libocc/identify/internal/assignment_problem.hpp"

namespace occ::internal::identify {

struct BlobTriple {
  std::array<int, 3> observations;  ///< the third is -1 for a pair
  double usefulness = 0;
  bool tried = false;
  bool far = false;  ///< the blobs are not neighbours in the image
  /// Bit i is set for observation i.
  std::uint64_t mask() const {
    std::uint64_t mask = 0;
    for (const int s : observations)
      if (s >= 0) mask |= std::uint64_t{1} << s;
    return mask;
  }
};

class LIBOCC_API TripleOrder {
 public:
  explicit TripleOrder(const AssignmentProblem& problem, int size = 3);  ///< size: 3 or 2

  /// Moves triples of neighbours to the front and makes their middle blob the first. For large
  /// maps, where only neighbouring lamps are combined.
  void prefer_neighbours(const AssignmentProblem& problem);

  /// Number of blobs used: the first ones of the problem.
  int blobs() const { return blobs_; }
  int groups() const { return static_cast<int>(triples_.size()); }  ///< tried and untried

  /// Returns the most useful untried group and marks it as tried. Empty when the groups tried
  /// suffice for `max_outliers` false lights, or when no group is left.
  std::optional<BlobTriple> next(int max_outliers);

 private:
  /// Untried group that excludes the most sets of one or two outliers; null when none is left.
  BlobTriple* best_excluding(int max_outliers);
  std::vector<std::uint64_t> outlier_sets(int size) const;

  int blobs_ = 0;
  std::vector<BlobTriple> triples_;  // most useful first
  std::vector<std::uint64_t> tried_;
  // Number of outliers for which the budget did not suffice to decide; it does not suffice for more
  // groups either, because the search takes the same branches.
  int undecided_ = -1;
};

}  // namespace occ::internal::identify
