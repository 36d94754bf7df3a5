// SPDX-License-Identifier: Apache-2.0
// RANSAC over namings (Fischler, Bolles, "Random sample consensus", CACM 24, 1981): three random
// blobs, three random lamps that can be seen together, the poses from which they look so, and what
// else these explain. It stops when one more sample would hardly find more.
#include <cmath>
#include <optional>

#include "libocc/core/random.hpp"
#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

// Blobs of three different sightings, and lamps that they may be.
std::optional<Naming> random_naming(const AssignmentProblem& problem, Random& random) {
  Naming naming;
  const int blobs = static_cast<int>(problem.sightings.size());
  for (Pair& pair : naming) {
    pair.sighting = random.below(blobs);
    const std::vector<int>& lamps = problem.sighting(pair.sighting).lamps;
    if (lamps.empty()) return std::nullopt;
    pair.target = lamps[random.below(static_cast<int>(lamps.size()))];
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const Pair &a = naming[i], &b = naming[(i + 1) % 3];
    if (a.sighting == b.sighting || a.target == b.target) return std::nullopt;
  }
  return naming;
}

// Samples after which, with probability `sure`, one was right: three true lights of `pairs` among
// all, each with its own lamp among those it may be.
double samples_needed(const AssignmentProblem& problem, int pairs) {
  constexpr double sure = 0.999;
  const double blobs = static_cast<double>(problem.sightings.size());
  const double lamps = static_cast<double>(problem.targets.size());
  const double right = std::pow(pairs / (blobs * lamps), 3);
  return std::log(1 - sure) / std::log1p(-right);
}

}  // namespace

void Search::sample() {
  Random random(problem_.options->seed);
  for (double needed = samples_needed(problem_, 4); tried_ < needed;) {
    if (tried_ == problem_.options->max_hypotheses) {
      cut_short_ = true;
      break;
    }
    ++tried_;
    const std::optional<Naming> naming = random_naming(problem_, random);
    if (!naming || contradicts_view(*naming)) continue;
    const Naming& n = *naming;
    if (!together_.triple(n[0].target, n[1].target, n[2].target)) continue;
    const int before = most_;
    for (const FittedPose& seed : seeds_of(*naming)) consider(seed, *naming);
    if (most_ > before && !found_.empty())
      needed = samples_needed(problem_, static_cast<int>(found_.back().pairs.size()));
  }
}

}  // namespace occ::internal::identify
