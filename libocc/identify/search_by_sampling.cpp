// SPDX-License-Identifier: Apache-2.0
// RANSAC over assignments (Fischler, Bolles, "Random sample consensus", CACM 24, 1981). Each sample
// assigns three random blobs to three random covisible lamps and verifies the resulting poses.
// Sampling stops when a better hypothesis is unlikely.
#include <cmath>
#include <optional>

#include "libocc/core/random.hpp"
#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

// Returns a random assignment of three blobs; nothing if the sample repeats a blob or lamp.
std::optional<Assignment> random_assignment(const AssignmentProblem& problem, Random& random) {
  Assignment assignment;
  const int blobs = static_cast<int>(problem.observations.size());
  for (Pair& pair : assignment) {
    pair.observation = random.below(blobs);
    const std::vector<int>& lamps = problem.observation(pair.observation).lamps;
    if (lamps.empty()) return std::nullopt;
    pair.map_point = lamps[random.below(static_cast<int>(lamps.size()))];
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Pair &a = assignment[i], &b = assignment[(i + 1) % 3];
    if (a.observation == b.observation || a.map_point == b.map_point) return std::nullopt;
  }
  return assignment;
}

// Number of samples after which one was correct with the probability `sure`: three true lights out
// of `pairs`, each assigned to its own lamp.
double samples_needed(const AssignmentProblem& problem, int pairs) {
  constexpr double sure = 0.999;
  const double blobs = static_cast<double>(problem.observations.size());
  const double lamps = static_cast<double>(problem.map_points.size());
  const double correct = std::pow(pairs / (blobs * lamps), 3);
  return std::log(1 - sure) / std::log1p(-correct);
}

}  // namespace

void Search::search_by_sampling() {
  Random random(problem_.options->seed);
  for (double needed = samples_needed(problem_, 4); tried_ < needed;) {
    if (tried_enough()) {
      cut_short_ = true;
      break;
    }
    ++tried_;
    const std::optional<Assignment> assignment = random_assignment(problem_, random);
    if (!assignment || contradicts_orientation(*assignment)) continue;
    const Assignment& n = *assignment;
    if (!covisibility_.triple(n[0].map_point, n[1].map_point, n[2].map_point)) continue;
    const int before = best_support_;
    for (const FittedPose& seed : candidates_from(*assignment)) consider(seed, *assignment);
    if (best_support_ > before && !found_.empty())
      needed = samples_needed(problem_, static_cast<int>(found_.back().pairs.size()));
  }
}

}  // namespace occ::internal::identify
