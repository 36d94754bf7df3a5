// SPDX-License-Identifier: Apache-2.0
#include "libocc/locate/internal/exclusion.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "libocc/refine/internal/estimated_map.hpp"

namespace occ {
namespace internal::locate {
namespace {

using refine::RankedPose;
using refine::RefinementAhead;

/// Pose without a lamp; empty unless the other lamps agree with each other.
std::optional<Refined> without_lamp(const RefinementAhead& ahead, const RefineOptions& options,
                                    const RankedPose& pose, int lamp) {
  std::vector<Match> matches = pose.hypothesis->matches;
  matches.erase(std::remove_if(matches.begin(), matches.end(),
                               [&](const Match& match) { return match.lamp == lamp; }),
                matches.end());
  Result<Refined> refined = refine::with_estimated_map(
      refine::refine_as_stated(pose.refined->cam_from_world, matches, ahead.blobs, ahead.scene,
                               options, ahead.image),
      matches, ahead.blobs, ahead.scene, options);
  if (!refined.ok() || refined->separation.excluded != pose.refined->separation.excluded ||
      !separated_lamps(refined->separation).empty())
    return std::nullopt;
  ++refined.value.separation.excluded;
  return std::move(refined.value);
}

}  // namespace

void exclude_separated_lamp(const RefinementAhead& ahead, refine::Refinement& refinement,
                            std::vector<int>& excluded) {
  RankedPose& best = refinement.poses.front();
  if (!best.refined.ok() || separated_lamps(best.refined->separation).empty()) return;
  RefineOptions options = ahead.options;
  options.rung = refinement.choice.rung;
  std::optional<Refined> only;
  int id = 0;
  for (const LampEquations& lamp : best.refined->separation.lamps) {
    std::optional<Refined> others = without_lamp(ahead, options, best, lamp.lamp);
    if (!others) continue;
    if (only) return;  // another lamp could be the faulty one
    only = std::move(others);
    id = ahead.scene.lamps[static_cast<std::size_t>(lamp.lamp)].id;
  }
  if (!only) return;
  best.refined.value = *std::move(only);
  excluded.push_back(id);
}

void take_separation(const Refined& refined, const Scene& scene, double fault_probability,
                     Fix& fix) {
  fix.separation = refined.separation;
  fix.separation.fault_probability = fault_probability;
  for (LampEquations& lamp : fix.separation.lamps)
    lamp.lamp = scene.lamps[static_cast<std::size_t>(lamp.lamp)].id;
  for (const LampResidual& lamp : refined.lamps)
    if (lamp.contradicts)
      fix.excluded_lamps.push_back(scene.lamps[static_cast<std::size_t>(lamp.match.lamp)].id);
  std::sort(fix.excluded_lamps.begin(), fix.excluded_lamps.end());
}

}  // namespace internal::locate

Result<ProtectionLevel> Fix::protection_level_m(double risk, double continuity_risk) const {
  return protection_level(separation, risk, continuity_risk, this->risk.value_or(0));
}

}  // namespace occ
