// SPDX-License-Identifier: Apache-2.0
// Errors that lamps share (scene_errors.hpp), linearised anew. Those of an uncalibrated camera move
// the image by thousands of sigmas, so the equations at a pose hold near their linearisation only.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/refine/internal/problem.hpp"

namespace occ::internal::refine {

/// The observations of the scene that contains these errors. False if that has no camera.
bool linearise_shared(const Eigen::VectorXd& errors, const Scene& stated,
                      const std::vector<Match>& matches, const std::vector<Blob>& blobs,
                      const RefineOptions& options, Observations& observations, Scene& scene);

/// Normal equations at any pose, with the shared errors at their minimum for that pose. Keeps
/// references to the first four arguments.
class SharedProfile {
 public:
  SharedProfile(const Scene& stated, const std::vector<Match>& matches,
                const std::vector<Blob>& blobs, const RefineOptions& options,
                Observations observations, Scene scene, Rung rung);

  /// False if a lamp is not visible, or the camera with the errors does not exist.
  bool linearise(const State& state, PoseNormalEquations& normal);

 private:
  const Scene& stated_;
  const std::vector<Match>& matches_;
  const std::vector<Blob>& blobs_;
  const RefineOptions& options_;
  Observations observations_;
  Scene scene_;
  Rung rung_;
};

}  // namespace occ::internal::refine
