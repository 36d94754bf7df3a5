// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/triples.hpp"
//
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace occ::naming {
namespace {

// Triples grow with the cube; a bounded number of the best blobs is enough to find a pose.
constexpr int max_blobs = 24;

// Ways to name three blobs with different lamps, at most (lists rarely overlap in part).
double namings(const Problem& problem, const std::array<int, 3>& s) {
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
double usefulness(const Problem& problem, const std::array<int, 3>& s, double brightest_dn) {
  const Eigen::Vector3d& origin = problem.sighting(s[0]).bearing;
  const Eigen::Vector3d a = problem.sighting(s[1]).bearing - origin;
  const Eigen::Vector3d b = problem.sighting(s[2]).bearing - origin;
  double dimmest_dn = brightest_dn;
  for (const int i : s) {
    const Blob& blob = (*problem.blobs)[static_cast<std::size_t>(problem.sighting(i).blob)];
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

TripleOrder::TripleOrder(const Problem& problem)
    : blobs_(std::min(static_cast<int>(problem.sightings.size()), max_blobs)) {
  double brightest_dn = 0;
  for (const Sighting& s : problem.sightings)
    brightest_dn =
        std::max(brightest_dn, (*problem.blobs)[static_cast<std::size_t>(s.blob)].flux_dn);
  for (int i = 0; i < blobs_; ++i)
    for (int j = i + 1; j < blobs_; ++j)
      for (int k = j + 1; k < blobs_; ++k) {
        const std::array<int, 3> s{i, j, k};
        triples_.push_back({s, usefulness(problem, s, brightest_dn)});
      }
  std::stable_sort(triples_.begin(), triples_.end(), [](const BlobTriple& a, const BlobTriple& b) {
    return a.usefulness > b.usefulness;
  });
}

std::optional<BlobTriple> TripleOrder::next(int false_lights) {
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
  found->tried = true;
  tried_.push_back(found->mask());
  return *found;
}

}  // namespace occ::naming
