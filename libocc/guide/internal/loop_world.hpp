// SPDX-License-Identifier: Apache-2.0
// Internal: the world of a closed loop: where the vehicle truly is, what its wheels say, and the
// images that its camera takes on the way.
#pragma once

#include <deque>
#include <map>
#include <vector>

#include "libocc/core/random.hpp"
#include "libocc/guide/closed_loop.hpp"
#include "libocc/simulate/renderer.hpp"

namespace occ::internal::guide {

struct Capture {
  double captured_s = 0;  ///< true time
  double stamped_s = 0;   ///< by the camera's clock
  bool lost = false;
  int times = 1;  ///< that it arrives
  int lamps_in_view = 0;
  Rigid3 cam_from_body;
  std::vector<int> dark;  ///< lamps that have failed
  Rendered rendered;
};

class LoopWorld {
 public:
  LoopWorld(const Scene& scene, const LoopOptions& options, const PlanarPose& start);

  const DriveState& state() const { return state_; }
  const DriveLimited& limited() const { return limited_; }
  double pan_rad() const { return pan_rad_; }
  double tilt_rad() const { return tilt_rad_; }

  /// Drives for dt_s while the camera turns towards `aim`; what the wheels say of it.
  PlanarOdometry step(const DriveCommand& command, const PanTiltKnot& aim, double dt_s);

  /// Images that have arrived by now, oldest first; lost ones come, too, without pixels.
  std::vector<Capture> arrived();

  /// For whoever has looked at it: its memory is used again.
  void recycle(Capture capture);

 private:
  void turn_camera(const PanTiltKnot& aim, double dt_s);
  void kidnap(double from_s);
  void capture(int number, const DriveState& before, double pan_before, double tilt_before,
               double share);
  void render(Capture& capture, int number, const Rigid3& cam_from_world, const Vector6& velocity);
  std::vector<int> dark_lamps(double time_s) const;
  PlanarOdometry as_told(PlanarOdometry step) const;
  Renderer& renderer_without(const std::vector<int>& dark);

  Scene scene_;
  const LoopOptions& options_;
  DriveState state_;
  DriveLimited limited_;
  double pan_rad_ = 0, tilt_rad_ = 0;
  Random driving_, frames_;
  int next_frame_ = 1;
  std::deque<Capture> under_way_;
  std::map<std::vector<int>, Renderer> renderers_;           // by the lamps that are dark
  std::map<std::vector<int>, std::vector<Rendered>> spare_;  // what each has filled before
};

}  // namespace occ::internal::guide
