// SPDX-License-Identifier: Apache-2.0
// The newest poses of a body as frames arrive: smooth/smoother.hpp over the last few poses
// (fixed lag). The oldest pose is marginalised: with A, b the normal equations of all that touches
// it,
//     information = A_11 - A_10 A_00^-1 A_01,  gradient = b_1 - A_10 A_00^-1 b_0
// of the next pose, about where that is now, stand for it and for all before (Schur complement;
// Sibley, Matthies, Sukhatme, "Sliding window filter with application to planetary landing", J.
// Field Robotics 27(5), 2010, section 3). What was linearised there stays so; everything in the
// window is linearised anew. Memory and time per frame do not grow.
//
// Frames may come late, or twice: one inside the window is put where it belongs, one at a time that
// is there already is a second camera. One before the window is not used, and said.
#pragma once

#include <memory>

#include "libocc/core/abi.hpp"
#include "libocc/smooth/smoother.hpp"

namespace occ {

struct LIBOCC_API WindowOptions {
  int poses = 10;
  SmootherOptions smoothing;

  void validate() const;  ///< throws std::invalid_argument naming the field and its value
};

template <class Pose>
struct WindowEstimate {
  Smoothing<Pose> window;  ///< oldest first; chi2 and dof are of the window
  Pose newest;             ///< the last of it
  bool used = true;        ///< false: what came was before the window
};

/// Poses in space. Status of the answers: ok; too_few_lamps, degenerate, not_converged as of
/// smooth(), of the window. What a caller gets wrong throws std::invalid_argument as there.
class LIBOCC_API WindowSmoother {
 public:
  using Estimate = Result<WindowEstimate<SmoothedPose>>;

  explicit WindowSmoother(const WindowOptions& options = {});
  ~WindowSmoother();
  WindowSmoother(WindowSmoother&&) noexcept;
  WindowSmoother& operator=(WindowSmoother&&) noexcept;

  /// In the order of time, before or after the frames at its ends. False, and not used, when it
  /// starts before the end of the last.
  bool add_odometry(const Odometry& odometry);
  Estimate add_frame(const SmootherFrame& frame);
  Estimate add_observation(const PoseObservation& observation);
  void restart();  ///< forgets everything, e.g. after the clock was set back

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Poses on a floor.
class LIBOCC_API PlanarWindowSmoother {
 public:
  using Estimate = Result<WindowEstimate<SmoothedPlanarPose>>;

  explicit PlanarWindowSmoother(const WindowOptions& options = {}, double height_m = 0);
  ~PlanarWindowSmoother();
  PlanarWindowSmoother(PlanarWindowSmoother&&) noexcept;
  PlanarWindowSmoother& operator=(PlanarWindowSmoother&&) noexcept;

  bool add_odometry(const PlanarOdometry& odometry);
  Estimate add_frame(const SmootherFrame& frame);
  Estimate add_observation(const PoseObservation& observation);
  Estimate add_prior(const PlanarPrior& prior);
  void restart();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace occ
