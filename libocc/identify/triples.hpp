// SPDX-License-Identifier: Apache-2.0
// Internal: which three blobs to try next. Trying every naming of three true lights finds every
// pose that contains them, so once an explanation leaves `false_lights` blobs unexplained, the
// search is complete when no set of that many blobs touches every triple tried: each other
// explanation as good would contain one of them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "libocc/identify/problem.hpp"

namespace occ::naming {

struct BlobTriple {
  std::array<int, 3> sightings;
  double usefulness = 0;
  bool tried = false;
  std::uint64_t mask() const {
    return std::uint64_t{1} << sightings[0] | std::uint64_t{1} << sightings[1] |
           std::uint64_t{1} << sightings[2];
  }
};

class TripleOrder {
 public:
  explicit TripleOrder(const Problem& problem);

  /// Blobs that triples are made of: the first ones of the problem.
  int blobs() const { return blobs_; }

  /// The most useful untried triple that the search still needs, marked as tried; nothing when no
  /// further one is needed to rule out `false_lights` false lights, or none is left.
  std::optional<BlobTriple> next(int false_lights);

 private:
  int blobs_ = 0;
  std::vector<BlobTriple> triples_;  // most useful first
  std::vector<std::uint64_t> tried_;
};

}  // namespace occ::naming
