// SPDX-License-Identifier: Apache-2.0
// Internal: the part of visibility that planners ask for many times: no power, no copies.
#pragma once

#include <vector>

#include "libocc/guide/visibility.hpp"

namespace occ::internal::guide {

/// Which lamps a camera has wholly in view, and what they tell of a pose on the floor.
class LampViews {
 public:
  /// The scene is valid and outlives this.
  LampViews(const Scene& scene, const VisibilityOptions& options);

  /// Indices into the scene's lamps.
  std::vector<int> in_view(const Rigid3& cam_from_world) const;
  int count_in_view(const Rigid3& cam_from_world) const;

  /// By the lamps of these indices. Fills in both sigmas.
  void bound(const PlanarPose& pose, const Rigid3& cam_from_body, const std::vector<int>& lamps,
             Visibility& seen) const;

 private:
  bool sees(std::size_t lamp, const Rigid3& cam_from_world, const Eigen::Vector3d& eye) const;

  const Scene& scene_;
  VisibilityOptions options_;
  std::vector<std::vector<Eigen::Vector3d>> rims_;  // of each lamp, in the world
};

}  // namespace occ::internal::guide
