// SPDX-License-Identifier: Apache-2.0
// Simulated world of a closed loop: true state of the vehicle, its odometry, and the images of its
// camera.
#pragma once

#include <Eigen/Core>
#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "libocc/core/random.hpp"
#include "libocc/guide/closed_loop.hpp"
#include "libocc/simulate/renderer.hpp"

namespace occ::internal::guide {

struct Capture {
  double captured_s = 0;  ///< true time
  double stamped_s = 0;   ///< time stamp of the camera's clock
  bool lost = false;
  int times = 1;  ///< number of arrivals
  int lamps_in_view = 0;
  Rigid3 cam_from_body;
  std::vector<int> dark;  ///< indices of lamps that have failed
  Rendered rendered;
};

class LoopWorld {
 public:
  LoopWorld(const Scene& scene, const LoopOptions& options, const PlanarPose& start);

  const DriveState& state() const { return state_; }
  const DriveLimited& limited() const { return limited_; }
  double pan_rad() const { return pan_rad_; }
  double tilt_rad() const { return tilt_rad_; }

  /// Advances the vehicle by dt_s and moves the camera towards `aim`. Returns the odometry.
  PlanarOdometry step(const DriveCommand& command, const PanTiltKnot& aim, double dt_s);

  /// Returns the images that have arrived by now, oldest first. Lost images are included without
  /// pixels.
  std::vector<Capture> arrived();

  /// Returns the memory of a processed image for reuse.
  void recycle(Capture capture);

 private:
  void turn_camera(const PanTiltKnot& aim, double dt_s);
  void kidnap(double from_s);
  void capture(int number, const DriveState& before, double pan_before, double tilt_before,
               double share);
  void render(Capture& capture, int number, const Rigid3& cam_from_world, const Vector6& velocity);
  std::vector<int> dark_lamps(double time_s) const;
  PlanarOdometry with_faults(PlanarOdometry step) const;
  Renderer& renderer_of(const std::vector<int>& dark, int phase);
  Rigid3 real_body(const PlanarPose& pose) const;
  int flicker_phase(double time_s) const;

  Scene scene_;  // the real one
  const LoopOptions& options_;
  Rigid3 mount_error_;  // of the camera
  Eigen::Matrix<double, 5, 1> floor_phases_rad_;
  DriveState state_;
  DriveLimited limited_;
  double pan_rad_ = 0, tilt_rad_ = 0;
  Random driving_, frames_;
  int next_frame_ = 1;
  std::deque<Capture> in_transit_;
  // The key is the set of dark lamps and the phase of the flicker.
  std::map<std::pair<std::vector<int>, int>, Renderer> renderers_;
  std::map<std::vector<int>, std::vector<Rendered>>
      spare_;  // buffers for reuse, by the set of dark lamps
};

}  // namespace occ::internal::guide
