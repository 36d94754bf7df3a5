// SPDX-License-Identifier: Apache-2.0
// Search among the blobs that look like lamps, before the others are tried: images of real rooms
// have dozens of specks, and the number of assignments grows with the third power of the blobs.
#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

constexpr std::size_t min_lamp_like = 4;
constexpr double max_share = 0.7;  // of all blobs: with more, the search is hardly shorter

/// Smallest over largest power of the lamps; 1 if none is known.
double range_of_powers(const AssignmentProblem& problem) {
  double low = infinity, high = 0;
  for (const MapPoint& point : problem.map_points) {
    if (!(point.power_w > 0)) continue;
    low = std::min(low, point.power_w);
    high = std::max(high, point.power_w);
  }
  return high > 0 ? low / high : 1;
}

bool has_shape(const AssignmentProblem& problem, const BearingObservation& s) {
  return s.max_radius_rad > 0 ||
         !(*problem.blobs)[static_cast<std::size_t>(s.blob)].corners_px.empty();
}

/// Indices of the observations with a code, with a rim, or with a flux that is not far below that
/// of the observations with a rim. Lamps that are large enough for a rim differ less in distance
/// and angle than that. Empty without enough of them, or if they are most of the blobs.
std::vector<int> lamp_like(const AssignmentProblem& problem) {
  constexpr double faint = 0.02;  // seven times as far
  std::vector<double> fluxes;
  for (const BearingObservation& s : problem.observations)
    if (has_shape(problem, s) && s.flux > 0) fluxes.push_back(s.flux);
  if (fluxes.size() < min_lamp_like) return {};
  const double min_flux = faint * range_of_powers(problem) * median(std::move(fluxes));
  std::vector<int> like;
  for (int i = 0; i < static_cast<int>(problem.observations.size()); ++i) {
    const BearingObservation& s = problem.observation(i);
    const Blob& blob = (*problem.blobs)[static_cast<std::size_t>(s.blob)];
    const bool is_faint = s.flux > 0 ? s.flux < min_flux : blob.flux_sigma_dn > 0;
    if (s.coded || has_shape(problem, s) || !is_faint) like.push_back(i);
  }
  const auto all = static_cast<double>(problem.observations.size());
  if (static_cast<double>(like.size()) > max_share * all) return {};
  return like;
}

AssignmentProblem with_only(const AssignmentProblem& problem, const std::vector<int>& kept) {
  AssignmentProblem part = problem;
  part.observations.clear();
  part.allowed.clear();
  const std::size_t points = problem.map_points.size();
  for (const int i : kept) {
    part.observations.push_back(problem.observation(i));
    const auto row = problem.allowed.begin() + static_cast<std::ptrdiff_t>(i * points);
    part.allowed.insert(part.allowed.end(), row, row + static_cast<std::ptrdiff_t>(points));
  }
  return part;
}

}  // namespace

// A hypothesis that explains most of these blobs leaves hardly any for a rival, which would have to
// match specks instead. Otherwise all blobs are searched.
bool Search::search_lamp_like(IdentifyMethod method) {
  constexpr double explained = 0.75;
  const std::vector<int> kept = lamp_like(problem_);
  if (kept.size() < min_lamp_like) return false;
  const AssignmentProblem part = with_only(problem_, kept);
  Search inside(part);
  inside.search_by(method);
  inside.merge_and_rank();
  const auto needed = static_cast<std::size_t>(
      std::max(4.0, std::ceil(explained * static_cast<double>(kept.size()))));
  const bool found = std::any_of(inside.found_.begin(), inside.found_.end(),
                                 [&](const auto& e) { return e.pairs.size() >= needed; });
  if (!found || inside.cut_short_) return false;
  const auto translate = [&](Pair& pair) {
    pair.observation = kept[static_cast<std::size_t>(pair.observation)];
  };
  for (PoseHypothesis& e : inside.found_) {
    for (Pair& pair : e.pairs) translate(pair);
    Assignment three;
    std::copy_n(e.pairs.begin(), 3, three.begin());
    std::vector<ScoredPair> more = additional_pairs(problem_, e.estimate, three);
    const bool others = std::any_of(more.begin(), more.end(), [&](const ScoredPair& p) {
      return std::none_of(e.pairs.begin(), e.pairs.end(), [&](const Pair& known) {
        return known.observation == p.pair.observation || known.map_point == p.pair.map_point;
      });
    });
    if (!others) continue;
    PoseHypothesis whole = verify_hypothesis(problem_, e.estimate, three, more);
    if (whole.pairs.size() <= e.pairs.size()) continue;
    account_for_unpaired_lamps(problem_, whole);
    whole.poses_scored = e.poses_scored;
    e = std::move(whole);
  }
  for (Seed& seed : inside.seeds_)
    for (Pair& pair : seed.assignment) translate(pair);
  adopt(std::move(inside));
  best_support_ = 0;
  for (const PoseHypothesis& e : found_) best_support_ = std::max(best_support_, support(e.pairs));
  return true;
}

}  // namespace occ::internal::identify
