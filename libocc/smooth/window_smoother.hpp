// SPDX-License-Identifier: Apache-2.0
// Fixed-lag smoothing: smooth/smoother.hpp over the last few poses, as frames arrive. The oldest
// pose (index 0) is marginalised. With A, b the normal equations of all terms that contain it,
//     information = A_11 - A_10 A_00^-1 A_01,  gradient = b_1 - A_10 A_00^-1 b_0
// become a prior of the next pose (Schur complement; Sibley, Matthies, Sukhatme, "Sliding window
// filter with application to planetary landing", J. Field Robotics 27(5), 2010, section 3). Its
// linearisation point is kept; all terms inside the window are linearised again. A pose that is not
// determined yet leaves no prior. Memory and time per frame are bounded.
//
// A window that begins with frames of a few lamps may have several minima (smooth/smoother.hpp).
// Each that the data leave plausible stays open, at most eight, also after its frames have left the
// window. The status is ambiguous until later frames decide.
//
// Frames may arrive late or twice. A frame inside the window is inserted at its time; one at the
// time of an existing pose is treated as a second camera. A frame before the window is ignored and
// reported.
#pragma once

#include <memory>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/smoother.hpp"

namespace occ {

/// Options of both window smoothers.
struct LIBOCC_API WindowOptions {
  int poses = 10;             ///< length of the window, at least 2
  SmootherOptions smoothing;  ///< options of the adjustment inside the window

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

/// State of the window after an input.
template <class Pose>
struct WindowEstimate {
  Smoothing<Pose> window;  ///< oldest first; chi2 and dof refer to the window
  Pose newest;             ///< the last pose of the window
  bool used = true;        ///< false: the input was before the window
};

/// Poses in space. Status and std::invalid_argument as for smooth(), applied to the window.
class LIBOCC_API WindowSmoother {
 public:
  /// State of the window, or the reason why it has no pose.
  using Estimate = Result<WindowEstimate<SmoothedPose>>;

  /// Throws std::invalid_argument for invalid options.
  explicit WindowSmoother(const WindowOptions& options = {});
  ~WindowSmoother();
  WindowSmoother(WindowSmoother&&) noexcept;
  WindowSmoother& operator=(WindowSmoother&&) noexcept;

  /// Steps must be in the order of time; a step may be added before or after the frames at its
  /// ends. Returns false and ignores the step if it starts before the end of the previous one.
  bool add_odometry(const Odometry& odometry);
  /// Adds the sightings of one image.
  Estimate add_frame(const SmootherFrame& frame);
  /// Adds the likelihood of a camera's pose.
  Estimate add_observation(const PoseObservation& observation);
  void restart();  ///< deletes all poses, e.g. after the clock was set back

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Poses on a floor.
class LIBOCC_API PlanarWindowSmoother {
 public:
  /// State of the window, or the reason why it has no pose.
  using Estimate = Result<WindowEstimate<SmoothedPlanarPose>>;

  /// `height_m`: height of the body's origin above the floor. Throws std::invalid_argument for
  /// invalid options.
  explicit PlanarWindowSmoother(const WindowOptions& options = {}, double height_m = 0);
  ~PlanarWindowSmoother();
  PlanarWindowSmoother(PlanarWindowSmoother&&) noexcept;
  PlanarWindowSmoother& operator=(PlanarWindowSmoother&&) noexcept;

  /// Adds a step; order and result as for WindowSmoother.
  bool add_odometry(const PlanarOdometry& odometry);
  /// Adds the sightings of one image.
  Estimate add_frame(const SmootherFrame& frame);
  /// Adds the likelihood of a camera's pose in space.
  Estimate add_observation(const PoseObservation& observation);
  /// Adds a pose known from elsewhere.
  Estimate add_prior(const PlanarPrior& prior);
  /// Deletes all poses, e.g. after the clock was set back.
  void restart();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace occ
