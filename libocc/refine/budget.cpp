// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/budget.hpp"

#include <algorithm>
#include <limits>

#include "libocc/refine/bound.hpp"
#include "libocc/refine/internal/expected_error.hpp"

namespace occ::internal::refine {
namespace {

/// Hypotheses with a larger chi-square than the best by this (a likelihood ratio of 1000) are not
/// refined by pixels: 2 ln 1000.
constexpr double max_direct_chi2 = 13.8;

bool has_rim(const RefinementAhead& ahead, const Match& match) {
  return !ahead.blobs[match.blob].rim.empty();
}

/// True if the direct rung uses the pixels of a lamp.
bool shows_pixels(const RefinementAhead& ahead, const Match& match) {
  const Blob& blob = ahead.blobs[match.blob];
  const Lamp& lamp = ahead.scene.lamps[match.lamp];
  const bool by_rows = blob.striped || (lamp.frequency_hz && ahead.scene.sensor.row_time_s > 0);
  return !by_rows && !blob.merged && !blob.cut_by_border && !blob.hidden_in_part;
}

/// Rungs that differ for these blobs, fastest first.
std::vector<Rung> rungs_on_offer(const RefinementAhead& ahead) {
  std::vector<Rung> rungs = {Rung::points, Rung::centres};
  const auto some = [&](bool (*holds)(const RefinementAhead&, const Match&)) {
    const std::vector<Match>& matches = ahead.hypotheses.front().matches;
    return std::any_of(matches.begin(), matches.end(),
                       [&](const Match& match) { return holds(ahead, match); });
  };
  if (some(has_rim)) rungs.push_back(Rung::rims);
  if (ahead.image && some(shows_pixels)) rungs.push_back(Rung::direct);
  return rungs;
}

/// All poses are refined by rims at most, then the plausible ones by pixels.
double predicted_s(const RefinementAhead& ahead, Rung rung) {
  const RungCosts& costs = ahead.costs;
  const Hypothesis& best = ahead.hypotheses.front();
  double sum = 0;
  int poses = 0;
  for (const Hypothesis& h : ahead.hypotheses) {
    if (poses++ == ahead.max_candidates) break;
    const RungWork work = work_of(h.matches, ahead.blobs);
    sum += costs.of(std::min(rung, Rung::rims)).predicted_s(work);
    const bool plausible =
        h.matches.size() >= best.matches.size() && h.chi2 - best.chi2 < max_direct_chi2;
    if (rung == Rung::direct && plausible) sum += costs.direct.predicted_s(work);
  }
  return sum;
}

/// Bound from a scene of the observed lamps. It takes half the time of the bound from the image,
/// but does not include priors, model errors and lamps without usable pixels; these cases use the
/// image.
Result<PoseBound> bound_of_pixels(const RefinementAhead& ahead, const RefineOptions& options) {
  const Hypothesis& best = ahead.hypotheses.front();
  const bool all_show = std::all_of(best.matches.begin(), best.matches.end(),
                                    [&](const Match& m) { return shows_pixels(ahead, m); });
  const bool prior = options.prior && !options.prior->empty();
  if (prior || options.model_sigma_px > 0 || !all_show) {
    return pose_bound(best.matches, ahead.blobs, ahead.scene, best.cam_from_world, options,
                      *ahead.image);
  }
  Scene seen = ahead.scene;
  seen.lamps.clear();
  for (const Match& match : best.matches) {
    seen.lamps.push_back(ahead.scene.lamps[match.lamp]);
  }
  return pose_bound(seen, best.cam_from_world, Rung::direct, options.flux);
}

double predicted_sigma_m(const RefinementAhead& ahead, Rung rung) {
  const Hypothesis& best = ahead.hypotheses.front();
  const Rigid3& pose = best.cam_from_world;
  RefineOptions options = ahead.options;
  options.rung = rung;
  const Result<PoseBound> bound =
      rung == Rung::direct ? bound_of_pixels(ahead, options)
                           : pose_bound(best.matches, ahead.blobs, ahead.scene, pose, options);
  if (!bound.ok()) return std::numeric_limits<double>::infinity();
  Vector6 bias = Vector6::Zero();
  if (rung == Rung::points) {
    bias = bias_of_points(best.matches, ahead.blobs, ahead.scene, pose, bound->covariance,
                          options.model_sigma_px);
  }
  return expected_error(pose, bound->covariance, bias).position_m;
}

}  // namespace

RungChoice rung_for(const RefinementAhead& ahead, const std::function<double()>& elapsed_s) {
  RungWish wish;
  wish.target_sigma_m = ahead.target_sigma_m;
  if (ahead.budget_s) wish.left_s = [&] { return *ahead.budget_s - elapsed_s(); };
  std::vector<RungForecast> forecasts;
  if (wish.target_sigma_m || wish.left_s) {
    for (const Rung rung : rungs_on_offer(ahead)) {
      forecasts.push_back({rung, predicted_s(ahead, rung), std::nullopt});
    }
  } else {
    const Rung asked = ahead.options.rung;
    const Rung rung = ahead.image ? asked : std::min(asked, Rung::rims);
    forecasts.push_back({rung, predicted_s(ahead, rung), std::nullopt});
  }
  return choose_rung(std::move(forecasts), wish,
                     [&](Rung rung) { return predicted_sigma_m(ahead, rung); });
}

}  // namespace occ::internal::refine
