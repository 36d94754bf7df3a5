// SPDX-License-Identifier: Apache-2.0
// Internal: which three blobs (or two, where two determine a pose) to try next. Trying every naming
// of three true lights finds every pose that contains them, so once an explanation leaves
// `false_lights` blobs unexplained, the search is complete when no set of that many blobs touches
// every triple tried: each other explanation as good would contain one of them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "libocc/identify/internal/problem.hpp"

namespace occ::internal::identify {

struct BlobTriple {
  std::array<int, 3> sightings;  ///< the third is -1 for two blobs
  double usefulness = 0;
  bool tried = false;
  bool far = false;  ///< not neighbours in the image
  std::uint64_t mask() const {
    std::uint64_t mask = 0;
    for (const int s : sightings)
      if (s >= 0) mask |= std::uint64_t{1} << s;
    return mask;
  }
};

class TripleOrder {
 public:
  explicit TripleOrder(const AssignmentProblem& problem, int size = 3);  ///< 3 or 2

  /// For maps so large that only lamps near each other are named: triples of neighbours come first,
  /// with the blob in their middle as the first.
  void prefer_neighbours(const AssignmentProblem& problem);

  /// Blobs that triples are made of: the first ones of the problem.
  int blobs() const { return blobs_; }

  /// The most useful untried triple that the search still needs, marked as tried; nothing when no
  /// further one is needed to rule out `false_lights` false lights, or none is left.
  std::optional<BlobTriple> next(int false_lights);

 private:
  /// Untried, ruling out most sets of that many (1 or 2) false lights; null when none is left.
  BlobTriple* max_telling(int false_lights);
  std::vector<std::uint64_t> suspects(int size) const;

  int blobs_ = 0;
  std::vector<BlobTriple> triples_;  // most useful first
  std::vector<std::uint64_t> tried_;
};

}  // namespace occ::internal::identify
