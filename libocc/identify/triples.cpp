// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/triples.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace occ::internal::identify {
namespace {

// Triples grow with the cube; a bounded number of the best blobs is enough to find a pose.
constexpr int max_blobs = 24;

// Ways to name three blobs with different lamps, at most (lists rarely overlap in part).
double namings(const AssignmentProblem& problem, const std::array<int, 3>& s) {
  double product = 1, taken = 0;
  for (const int i : s) {
    const double lamps = static_cast<double>(problem.sighting(i).lamps.size());
    product *= std::max(1.0, lamps - taken);
    taken += problem.sighting(i).named ? 0 : 1;
  }
  return product;
}

// Far apart (the pose's errors go as one over the triangle's area), bright (reflections are dim),
// cheap to try.
double usefulness(const AssignmentProblem& problem, const std::array<int, 3>& s,
                  double brightest_dn) {
  const Eigen::Vector3d& origin = problem.sighting(s[0]).bearing;
  const Eigen::Vector3d a = problem.sighting(s[1]).bearing - origin;
  const Eigen::Vector3d b = problem.sighting(s[2]).bearing - origin;
  double dimmest_dn = brightest_dn;
  for (const int i : s) {
    const Blob& blob = (*problem.blobs)[problem.sighting(i).blob];
    dimmest_dn = std::min(dimmest_dn, blob.flux_dn);
  }
  const double brightness = brightest_dn > 0 ? std::max(0.01, dimmest_dn / brightest_dn) : 1;
  return a.cross(b).norm() * std::sqrt(brightness / namings(problem, s));
}

// Looks for at most `size` blobs that touch every triple, by branching over the blobs of the first
// triple still untouched, dim ones first. `budget` bounds the work.
bool touch_all(const std::vector<std::uint64_t>& triples, int size, int& budget,
               std::uint64_t& touched) {
  const auto untouched = std::find_if(triples.begin(), triples.end(),
                                      [&](std::uint64_t t) { return (t & touched) == 0; });
  if (untouched == triples.end()) return true;
  if (size == 0 || --budget < 0) return false;
  for (int bit = max_blobs - 1; bit >= 0; --bit) {
    const std::uint64_t one = std::uint64_t{1} << bit;
    if ((*untouched & one) == 0) continue;
    touched |= one;
    if (touch_all(triples, size - 1, budget, touched)) return true;
    touched &= ~one;
  }
  return false;
}

}  // namespace

TripleOrder::TripleOrder(const AssignmentProblem& problem, int size)
    : blobs_(std::min(static_cast<int>(problem.sightings.size()), max_blobs)) {
  double brightest_dn = 0;
  for (const BearingObservation& s : problem.sightings)
    brightest_dn = std::max(brightest_dn, (*problem.blobs)[s.blob].flux_dn);
  for (int i = 0; i < blobs_; ++i)
    for (int j = i + 1; j < blobs_; ++j) {
      if (size == 2) {
        const Eigen::Vector3d apart = problem.sighting(i).bearing - problem.sighting(j).bearing;
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

// In a wide search the first blob is the one that is nearest to the others, and those not among its
// nearest in the image come last: their lamps would be far apart in the map.
void TripleOrder::prefer_neighbours(const AssignmentProblem& problem) {
  const auto distance = [&](int i, int j) {
    return (problem.sighting(i).bearing - problem.sighting(j).bearing).norm();
  };
  constexpr int nearest = 8;
  std::vector<double> reach;  // of the nearer half of the other blobs, or of so many
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
    std::array<int, 3> best = t.sightings, turned = t.sightings;
    for (int k = 0; k < (t.sightings[2] < 0 ? 2 : 3); ++k) {
      if (excess(turned) < excess(best)) best = turned;
      if (t.sightings[2] < 0)
        std::swap(turned[0], turned[1]);
      else
        std::rotate(turned.begin(), turned.begin() + 1, turned.end());
    }
    t.sightings = best;
    t.far = excess(best) > 1;
  }
  std::stable_partition(triples_.begin(), triples_.end(),
                        [](const BlobTriple& t) { return !t.far; });
}

// Sets of one or two blobs that touch every triple tried.
std::vector<std::uint64_t> TripleOrder::suspects(int size) const {
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

BlobTriple* TripleOrder::max_telling(int false_lights) {
  const std::vector<std::uint64_t> sets = suspects(false_lights);
  BlobTriple* best = nullptr;
  std::ptrdiff_t most = 0;
  for (BlobTriple& t : triples_) {
    if (t.tried || (best && t.far && !best->far)) continue;
    const std::uint64_t mask = t.mask();
    const auto ruled_out = std::count_if(sets.begin(), sets.end(),
                                         [&](std::uint64_t set) { return (set & mask) == 0; });
    if (ruled_out > most) {
      most = ruled_out;
      best = &t;
    }
  }
  return best;
}

std::optional<BlobTriple> TripleOrder::next(int false_lights) {
  const auto take = [&](BlobTriple& t) {
    t.tried = true;
    tried_.push_back(t.mask());
    return t;
  };
  if (false_lights == 1 || false_lights == 2) {
    BlobTriple* const telling = max_telling(false_lights);
    return telling ? std::optional(take(*telling)) : std::nullopt;
  }
  std::uint64_t suspects = 0;
  int budget = 2000;
  if (!touch_all(tried_, false_lights, budget, suspects)) {
    if (budget >= 0) return std::nullopt;
    suspects = 0;  // too hard to tell: go on in order
  }
  const auto untried = [&](std::uint64_t without) {
    return std::find_if(triples_.begin(), triples_.end(),
                        [&](const BlobTriple& t) { return !t.tried && (t.mask() & without) == 0; });
  };
  auto found = untried(suspects);
  if (found == triples_.end()) found = untried(0);
  if (found == triples_.end()) return std::nullopt;
  return take(*found);
}

}  // namespace occ::internal::identify
