// SPDX-License-Identifier: Apache-2.0
#include "libocc/identify/internal/wrong_sizes.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>
#include <vector>

#include "libocc/core/statistics.hpp"
#include "libocc/identify/internal/search.hpp"

namespace occ::internal::identify {
namespace {

/// Apparent over predicted sizes of the lamps whose rims were measured.
std::vector<double> size_ratios(const AssignmentProblem& problem, const PoseHypothesis& e) {
  std::vector<double> ratios;
  for (const Pair& pair : e.pairs) {
    const BearingObservation& s = problem.observation(pair.observation);
    const MapPoint& t = problem.map_point(pair.map_point);
    if (t.disc && s.radius_rad > 0)
      ratios.push_back(size_ratio(s, t, (e.estimate.pose * t.centre).norm()));
  }
  return ratios;
}

}  // namespace

std::string advice_on_sizes(const AssignmentProblem& problem) {
  constexpr int max_hypotheses = 20000;            // some milliseconds
  constexpr double any_size = 10, unusual = 0.15;  // the latter of ln of the ratio
  constexpr std::ptrdiff_t min_sized = 3;
  const auto sized = std::count_if(problem.observations.begin(), problem.observations.end(),
                                   [](const BearingObservation& s) { return s.radius_rad > 0; });
  if (sized < min_sized) return {};
  IdentifyOptions options = *problem.options;
  options.max_hypotheses = std::min(options.max_hypotheses, max_hypotheses);
  AssignmentProblem open = problem;
  open.options = &options;
  for (MapPoint& point : open.map_points) point.size_sigma = any_size;
  Search search(open);
  search.run();
  if (search.found().empty() || search.chance() > max_chance_if_missing) return {};
  const PoseHypothesis& best = search.found().front();
  std::vector<double> ratios = size_ratios(open, best);
  if (static_cast<std::ptrdiff_t>(ratios.size()) < min_sized) return {};
  const double ratio = median(std::move(ratios));
  if (std::abs(std::log(ratio)) < unusual) return {};
  std::ostringstream text;
  text.precision(2);
  text << "a pose matches " << best.pairs.size() << " lamps, but they appear " << ratio
       << " times as large as predicted: check radius_m, the focal length and the units of the "
          "map, or state the errors (size_sigma)";
  return text.str();
}

}  // namespace occ::internal::identify
