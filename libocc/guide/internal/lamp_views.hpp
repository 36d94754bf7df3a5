// SPDX-License-Identifier: Apache-2.0
// Visibility of lamps for planners, which evaluate many poses: without received power and without
// copies.
#pragma once

#include <vector>

#include "libocc/guide/visibility.hpp"

namespace occ::internal::guide {

/// Determines which lamps a camera has completely in view, and the resulting bound of a pose on the
/// floor.
class LampViews {
 public:
  /// The scene must be valid and outlive this object.
  LampViews(const Scene& scene, const VisibilityOptions& options);

  /// Returns indices into the scene's lamps.
  std::vector<int> in_view(const Rigid3& cam_from_world) const;
  int count_in_view(const Rigid3& cam_from_world) const;

  /// Sets both standard deviations of `seen` from the lamps with these indices.
  void bound(const PlanarPose& pose, const Rigid3& cam_from_body, const std::vector<int>& lamps,
             Visibility& seen) const;

 private:
  bool sees(std::size_t lamp, const Rigid3& cam_from_world, const Eigen::Vector3d& eye) const;

  const Scene& scene_;
  VisibilityOptions options_;
  std::vector<std::vector<Eigen::Vector3d>> rims_;  // rim of each lamp, in the world
};

}  // namespace occ::internal::guide
