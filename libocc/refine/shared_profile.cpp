// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/shared_profile.hpp"

#include <stdexcept>
#include <utility>

namespace occ::internal::refine {

bool linearise_shared(const Eigen::VectorXd& errors, const Scene& stated,
                      const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                      const RefineOptions& options, Observations& observations, Scene& scene) {
  try {
    observations.shared_errors.apply(stated, errors, scene);
  } catch (const std::invalid_argument&) {  // such as a negative focal length
    return false;
  }
  const Observations before = std::move(observations);
  observations = observe(matches, blobs, scene, options);
  observations.shared_shift = errors;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    observations.lamps[i].contradicts = before.lamps[i].contradicts;
    observations.lamps[i].unit_error = before.lamps[i].unit_error;
  }
  return true;
}

SharedProfile::SharedProfile(const Scene& stated, const std::vector<Match>& matches,
                             const std::vector<Blob>& blobs, const RefineOptions& options,
                             Observations observations, Scene scene, Rung rung)
    : stated_(stated),
      matches_(matches),
      blobs_(blobs),
      options_(options),
      observations_(std::move(observations)),
      scene_(std::move(scene)),
      rung_(rung) {}

bool SharedProfile::linearise(const State& state, PoseNormalEquations& normal) {
  constexpr int max_passes = 10;
  constexpr double stable = 0.02;  // sigmas
  for (int pass = 0; pass < max_passes; ++pass) {
    RefineProblem problem(observations_, scene_, options_, rung_);
    if (!problem.linearise(state, problem.pivot(state), normal)) return false;
    const Eigen::VectorXd errors = problem.shared_estimate(Vector8::Zero());
    if ((errors - observations_.shared_shift).norm() < stable) return true;
    if (!linearise_shared(errors, stated_, matches_, blobs_, options_, observations_, scene_))
      return false;
    observations_.move_rims(state.growth_px, scene_.camera);
  }
  return true;
}

}  // namespace occ::internal::refine
