// SPDX-License-Identifier: Apache-2.0
// Other poses from which the tracked lamps have their centres where they are. A tracker that uses
// centres only cannot see from one image which of them is right.
#include <algorithm>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/refine/internal/pose_evidence.hpp"
#include "libocc/refine/internal/pose_roots.hpp"
#include "libocc/track/internal/tracker_impl.hpp"

namespace occ::internal::track {

namespace {

/// With more lamps, their centres have one pose.
constexpr std::size_t max_lamps = 4;

/// The sizes of the lamps are measured in one of so many images while other poses fit.
constexpr int images_between_checks = 10;

/// The doubt recurs in the following images: its deviation is taken as that of the mean of
/// nine.
constexpr double recurrence = 3;

/// Makes the observation that of a mixture of two poses, `apart` from each other, with equal first
/// and second moments (formula of Sherman and Morrison).
void cover(const Vector6& apart, double probability, PoseObservation& seen) {
  const Vector6 shift = probability * apart;
  const Vector6 spread = recurrence * std::sqrt(probability * (1 - probability)) * apart;
  const Vector6 weighted = seen.information * spread;
  const double share = 1 / (1 + spread.dot(weighted));
  seen.information -= share * weighted * weighted.transpose();
  seen.gradient -= share * weighted * spread.dot(seen.gradient);
  if (!seen.systematic.empty())
    seen.gradient_by_systematic -=
        share * weighted * (spread.transpose() * seen.gradient_by_systematic).eval();
  seen.gradient -= seen.information * shift;
}

/// Probabilities of the branches by the lamps and a prior.
std::vector<double> probabilities_of(const std::vector<Refined>& branches,
                                     const std::vector<Match>& matches,
                                     const std::vector<Blob>& blobs, const Scene& scene,
                                     const std::optional<Prior>& prior) {
  Hypothesis hypothesis;
  hypothesis.matches = matches;
  std::vector<pose::PoseEvidence> evidence;
  for (const Refined& branch : branches)
    evidence.push_back(refine::evidence_of(branch, hypothesis, blobs, scene, prior));
  std::vector<double> logs;
  for (const pose::LogEvidence& log : pose::log_evidences(evidence)) logs.push_back(log.value);
  return pose::probabilities(logs);
}

}  // namespace

/// Poses of the lamps alone: first that of `tracked`, then the others. Empty if there are no
/// others.
std::vector<Refined> TrackerImpl::branches_of(const Refined& tracked, const Found& found,
                                              const Scene& scene, RefineOptions options) {
  std::vector<Refined> branches;
  if (options.rung >= Rung::rims || found.matches.size() > max_lamps) return branches;
  options.prior.reset();
  const auto add = [&](const Rigid3& start) {
    Result<Refined> pose = occ::refine(start, found.matches, found.blobs, scene, options);
    if (pose.ok()) branches.push_back(std::move(pose.value));
    return pose.ok();
  };
  const std::vector<Rigid3> roots = refine::other_roots(tracked, found.blobs, scene);
  if (roots.empty() || !add(tracked.cam_from_world)) return {};
  for (const Rigid3& root : roots) add(root);
  return branches.size() > 1 ? branches : std::vector<Refined>{};
}

/// Compares the branches by the prediction and by the sizes of the lamps. A branch inside the gate
/// of the prediction widens the observation. Returns false if the lamps alone leave all branches
/// inside the gate less than max_risk. The prediction has no say in that, because it comes from
/// images that were evaluated by the branch in doubt.
bool TrackerImpl::weigh_branches(const Job& job, const PredictedCamera& camera, const Found& found,
                                 const RefineOptions& options, const Refined& tracked,
                                 PoseObservation& seen) {
  const std::vector<Refined> branches = branches_of(tracked, found, job.view.scene, options);
  sizes_next_ = !branches.empty() && --images_until_check_ < 0;
  if (sizes_next_) images_until_check_ = images_between_checks;
  if (branches.empty()) {
    images_until_check_ = 0;
    return true;
  }
  const auto by = [&](const std::optional<Prior>& prior) {
    return probabilities_of(branches, found.matches, found.blobs, job.view.scene, prior);
  };
  const std::vector<double> shares = by(options.prior), alone = by(lasting_prior(job));
  double inside = alone[0], outside = 0;
  for (std::size_t i = 1; i < branches.size(); ++i) {
    const Vector6 apart = difference(branches[i].cam_from_world, branches[0].cam_from_world);
    const Vector6 off = difference(branches[i].cam_from_world, camera.cam_from_world);
    const Matrix6 covariance = camera.covariance + branches[i].covariance;
    const bool is_inside =
        off.dot(core::solve_llt(covariance, off)) <= gate_chi2(filter_.gate_sigma(), 6);
    (is_inside ? inside : outside) += alone[i];
    if (!is_inside) continue;
    sizes_next_ = true;
    cover(apart, shares[i] / (shares[0] + shares[i]), seen);
  }
  const bool excluded = inside < options_.locate.max_risk * (inside + outside);
  sizes_next_ = sizes_next_ || excluded;
  return !excluded;
}

}  // namespace occ::internal::track
