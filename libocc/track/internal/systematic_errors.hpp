// SPDX-License-Identifier: Apache-2.0
// Systematic errors of a tracker's images: stated errors of map and cameras, of their mounts and of
// the clock.
#pragma once

#include <array>
#include <map>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/pose_observation.hpp"
#include "libocc/refine/internal/error_gradient.hpp"
#include "libocc/track/filter_update.hpp"
#include "libocc/track/tracker.hpp"

namespace occ::internal::track {

class LIBOCC_API SystematicErrors {
 public:
  explicit SystematicErrors(const TrackerOptions& options);

  /// True if mount or clock have errors.
  bool has_own() const { return !mount_sigmas_.isZero(0) || clock_sigma_s_ > 0; }

  /// Adds the errors of the scene, which `seen` contains as independent of other images.
  void add_scene(const refine::ErrorGradient& errors, const Scene& scene, int camera,
                 PoseObservation& seen);
  /// Adds the errors of the mount and of the clock; `velocity`: of the camera.
  void add_own(int camera, const Vector6& velocity, PoseObservation& seen);
  /// Covariance of a camera's pose due to them.
  Matrix6 own_covariance(const Vector6& velocity) const;
  /// Covariance of a camera's pose from a prediction of the body, with the errors of mount and
  /// clock.
  Matrix6 camera_covariance(const PosePrediction& predicted, const Rigid3& cam_from_body,
                            int camera) const;

 private:
  enum Kind { lamp, map, camera_parameter, mount, clock };
  using Key = std::array<int, 3>;  // kind, camera or lamp, component

  int number(const Key& key);

  Vector6 mount_sigmas_;
  double clock_sigma_s_;
  std::map<Key, int> numbers_;
};

}  // namespace occ::internal::track
