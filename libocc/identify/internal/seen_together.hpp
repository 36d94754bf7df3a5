// SPDX-License-Identifier: Apache-2.0
// Internal: which points of an object one camera can see at once: there must be a place in the
// cones of all of them. Namings of blobs by points that cannot are not tried.
#pragma once

#include <vector>

#include "libocc/identify/internal/problem.hpp"

namespace occ::internal::identify {

/// False only when no camera nearer than a thousand times the object's size is in all cones: cones
/// that are wider than the half space count as no restriction, and what takes long to tell as true.
LIBOCC_API bool seen_together(const AssignmentProblem& problem, const std::vector<int>& targets);

/// The answers for two and for three, kept. Of a scene's lamps all are taken to be seen together.
class SeenTogether {
 public:
  explicit SeenTogether(const AssignmentProblem& problem);

  bool all() const { return pairs_.empty(); }
  bool pair(int a, int b) const {
    return all() || pairs_[static_cast<std::size_t>(a) * count_ + static_cast<std::size_t>(b)] != 0;
  }
  bool triple(int a, int b, int c);

 private:
  const AssignmentProblem& problem_;
  std::size_t count_;
  std::vector<char> pairs_;
  std::vector<char> triples_;  // 0: not known yet, 1: yes, 2: no
};

}  // namespace occ::internal::identify
