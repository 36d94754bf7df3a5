// SPDX-License-Identifier: Apache-2.0
// Decides which points of an object can be visible to one camera: the intersection of their
// visibility cones must not be empty. Assignments of other points are not tried.
#pragma once

#include <vector>

#include "libocc/identify/internal/assignment_problem.hpp"

namespace occ::internal::identify {

/// Returns false only if no camera position nearer than 1000 times the object's size is inside all
/// cones. Cones wider than a half space are ignored. Returns true if the iteration limit is
/// reached.
LIBOCC_API bool are_covisible(const AssignmentProblem& problem, const std::vector<int>& map_points);

/// Cached results for pairs and triples of points. All lamps of a scene count as covisible.
class Covisibility {
 public:
  explicit Covisibility(const AssignmentProblem& problem);

  bool all() const { return pairs_.empty(); }
  bool pair(int a, int b) const { return all() || pairs_[a * count_ + b] != 0; }
  bool triple(int a, int b, int c);

 private:
  const AssignmentProblem& problem_;
  std::size_t count_;
  std::vector<char> pairs_;
  std::vector<char> triples_;  // 0: not yet computed, 1: covisible, 2: not covisible
};

}  // namespace occ::internal::identify
