// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/triple_order.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace occ::internal::identify {
namespace {

// The number of triples grows with the third power; a bounded number of blobs suffices to find a
// pose.
constexpr int max_blobs = 24;

// Upper bound of the number of assignments of three blobs to different lamps. It assumes that lists
// of candidate lamps are equal or disjoint.
double assignments(const AssignmentProblem& problem, const std::array<int, 3>& s) {
  double product = 1, used = 0;
  for (const int i : s) {
    const double lamps = static_cast<double>(problem.observation(i).lamps.size());
    product *= std::max(1.0, lamps - used);
    used += problem.observation(i).coded ? 0 : 1;
  }
  return product;
}

// Large triangles (the pose error is inversely proportional to the area), bright blobs (reflections
// are faint) and few assignments are preferred.
double usefulness(const AssignmentProblem& problem, const std::array<int, 3>& s,
                  double brightest_dn) {
  const Eigen::Vector3d& origin = problem.observation(s[0]).bearing;
  const Eigen::Vector3d a = problem.observation(s[1]).bearing - origin;
  const Eigen::Vector3d b = problem.observation(s[2]).bearing - origin;
  double dimmest_dn = brightest_dn;
  for (const int i : s) {
    const Blob& blob = (*problem.blobs)[problem.observation(i).blob];
    dimmest_dn = std::min(dimmest_dn, blob.flux_dn);
  }
  const double brightness = brightest_dn > 0 ? std::max(0.01, dimmest_dn / brightest_dn) : 1;
  return a.cross(b).norm() * std::sqrt(brightness / assignments(problem, s));
}

// Searches for at most `size` blobs that intersect every triple. Branches over the blobs of the
// first triple not yet hit, faint ones first. `budget` bounds the number of branches.
bool hits_all(const std::vector<std::uint64_t>& triples, int size, int& budget,
              std::uint64_t& chosen) {
  const auto open = std::find_if(triples.begin(), triples.end(),
                                 [&](std::uint64_t t) { return (t & chosen) == 0; });
  if (open == triples.end()) return true;
  if (size == 0 || --budget < 0) return false;
  for (int bit = max_blobs - 1; bit >= 0; --bit) {
    const std::uint64_t one = std::uint64_t{1} << bit;
    if ((*open & one) == 0) continue;
    chosen |= one;
    if (hits_all(triples, size - 1, budget, chosen)) return true;
    chosen &= ~one;
  }
  return false;
}

}  // namespace

TripleOrder::TripleOrder(const AssignmentProblem& problem, int size)
    : blobs_(std::min(static_cast<int>(problem.observations.size()), max_blobs)) {
  double brightest_dn = 0;
  for (const BearingObservation& s : problem.observations)
    brightest_dn = std::max(brightest_dn, (*problem.blobs)[s.blob].flux_dn);
  for (int i = 0; i < blobs_; ++i)
    for (int j = i + 1; j < blobs_; ++j) {
      if (size == 2) {
        const Eigen::Vector3d apart =
            problem.observation(i).bearing - problem.observation(j).bearing;
        triples_.push_back({{i, j, -1}, apart.norm()});
        continue;
      }
      for (int k = j + 1; k < blobs_; ++k) {
        const std::array<int, 3> s{i, j, k};
        triples_.push_back({s, usefulness(problem, s, brightest_dn)});
      }
    }
  std::stable_sort(triples_.begin(), triples_.end(), [](const BlobTriple& a, const BlobTriple& b) {
    return a.usefulness > b.usefulness;
  });
}

// The first blob becomes the one nearest to the others. Triples whose blobs are not nearest
// neighbours in the image come last: their lamps are far apart in the map.
void TripleOrder::prefer_neighbours(const AssignmentProblem& problem) {
  const auto distance = [&](int i, int j) {
    return (problem.observation(i).bearing - problem.observation(j).bearing).norm();
  };
  constexpr int nearest = 8;
  std::vector<double> reach;  // for each blob: distance to its k-th nearest, with k half the other
                              // blobs, at most `nearest`
  for (int i = 0; i < blobs_; ++i) {
    std::vector<double> distances;
    for (int j = 0; j < blobs_; ++j) distances.push_back(distance(i, j));
    const auto half = distances.begin() + std::min((blobs_ + 1) / 2, nearest);
    std::nth_element(distances.begin(), half, distances.end());
    reach.push_back(*half);
  }
  const auto excess = [&](const std::array<int, 3>& s) {
    const double first = distance(s[0], s[1]);
    const double farthest = s[2] < 0 ? first : std::max(first, distance(s[0], s[2]));
    return farthest / reach[s[0]];
  };
  for (BlobTriple& t : triples_) {
    std::array<int, 3> best = t.observations, rotated = t.observations;
    for (int k = 0; k < (t.observations[2] < 0 ? 2 : 3); ++k) {
      if (excess(rotated) < excess(best)) best = rotated;
      if (t.observations[2] < 0)
        std::swap(rotated[0], rotated[1]);
      else
        std::rotate(rotated.begin(), rotated.begin() + 1, rotated.end());
    }
    t.observations = best;
    t.far = excess(best) > 1;
  }
  std::stable_partition(triples_.begin(), triples_.end(),
                        [](const BlobTriple& t) { return !t.far; });
}

// Returns the sets of one or two blobs that intersect every triple tried.
std::vector<std::uint64_t> TripleOrder::outlier_sets(int size) const {
  std::vector<std::uint64_t> sets;
  const auto add = [&](std::uint64_t set) {
    if (std::all_of(tried_.begin(), tried_.end(), [&](std::uint64_t t) { return (t & set) != 0; }))
      sets.push_back(set);
  };
  for (int i = 0; i < blobs_; ++i) {
    const std::uint64_t one = std::uint64_t{1} << i;
    if (size == 1) add(one);
    for (int j = i + 1; size == 2 && j < blobs_; ++j) add(one | std::uint64_t{1} << j);
  }
  return sets;
}

BlobTriple* TripleOrder::best_excluding(int max_outliers) {
  const std::vector<std::uint64_t> sets = outlier_sets(max_outliers);
  BlobTriple* best = nullptr;
  std::ptrdiff_t max_excluded = 0;
  for (BlobTriple& t : triples_) {
    if (t.tried || (best && t.far && !best->far)) continue;
    const std::uint64_t mask = t.mask();
    const auto excluded = std::count_if(sets.begin(), sets.end(),
                                        [&](std::uint64_t set) { return (set & mask) == 0; });
    if (excluded > max_excluded) {
      max_excluded = excluded;
      best = &t;
    }
  }
  return best;
}

std::optional<BlobTriple> TripleOrder::next(int max_outliers) {
  const auto take = [&](BlobTriple& t) {
    t.tried = true;
    tried_.push_back(t.mask());
    return t;
  };
  if (max_outliers == 1 || max_outliers == 2) {
    BlobTriple* const informative = best_excluding(max_outliers);
    return informative ? std::optional(take(*informative)) : std::nullopt;
  }
  std::uint64_t outlier_sets = 0;
  int budget = 2000;
  if (max_outliers != undecided_ && !hits_all(tried_, max_outliers, budget, outlier_sets)) {
    if (budget >= 0) return std::nullopt;
    outlier_sets = 0;  // undecided within the budget: continue in order
    undecided_ = max_outliers;
  }
  const auto untried = [&](std::uint64_t without) {
    return std::find_if(triples_.begin(), triples_.end(),
                        [&](const BlobTriple& t) { return !t.tried && (t.mask() & without) == 0; });
  };
  auto found = untried(outlier_sets);
  if (found == triples_.end()) found = untried(0);
  if (found == triples_.end()) return std::nullopt;
  return take(*found);
}

}  // namespace occ::internal::identify
