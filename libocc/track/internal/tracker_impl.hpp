// SPDX-License-Identifier: Apache-2.0
// Implementation of Tracker.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/track/internal/expected_lamps.hpp"
#include "libocc/track/internal/integrity_monitor.hpp"
#include "libocc/track/internal/motion_filter.hpp"
#include "libocc/track/internal/systematic_errors.hpp"
#include "libocc/track/tracker.hpp"

namespace occ::internal::track {

class TrackerImpl {
 public:
  TrackerImpl(const Scene& scene, const TrackerOptions& options, const Rigid3& cam_from_body);

  int add_camera(const Scene& scene, const Rigid3& cam_from_body);
  void start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance);
  TrackedFrame add_image(const ImageView& image, double time_s, const FrameSource& source);
  std::optional<PosePrediction> predict(double time_s) const;

  MotionFilter& filter() { return filter_; }
  const MotionFilter& filter() const { return filter_; }
  TrackerState state() const { return state_; }
  IntegrityMonitor& integrity() { return integrity_; }
  double protection_level_m(double time_s) const;

 private:
  struct CameraState {  // a camera and the times of its images
    Scene scene;
    Rigid3 cam_from_body;
    bool is_exact = true;  // the scene states no errors
    double last_s = -std::numeric_limits<double>::infinity();
    double last_refused_s = -std::numeric_limits<double>::infinity();
    int refused = 0;
    std::map<int, LampLook> looks{};  // by lamp id, as last measured
  };

  /// The image that is being processed.
  struct Job {
    const ImageView& image;
    CameraState& view;
    Rigid3 cam_from_body;
    TrackedFrame frame;
    std::string note;       ///< prepended to the reason of the frame
    bool searched = false;  ///< the whole image was searched, with or without success
    bool dark = false;      ///< no lamp was found, and all expected ones may be dark
    double seen_s = 0;      ///< mean time of the lines that show its lamps
  };

  /// Lamps that were found, with their blobs.
  struct Found {
    std::vector<Match> matches;
    std::vector<Blob> blobs;
  };

  /// A pose outside the gate of its prediction.
  struct Jump {
    double time_s = 0;
    Rigid3 body_from_world;
    Matrix6 covariance = Matrix6::Zero();
  };

  bool in_order(Job& job);
  void restart_clock(Job& job);
  bool usable(const PosePrediction& predicted) const;
  PredictedCamera camera_at(const PosePrediction& predicted, const Job& job) const;

  bool has_systematic(const Job& job) const;
  void add_systematic(const Job& job, const PredictedCamera& camera, const Refined& refined,
                      const Found& found, const RefineOptions& options, PoseObservation& seen);
  static Found found_by(const Fix& fix, const Scene& scene);
  bool begin_with_systematic(Job& job, double time_s, const Rigid3& body_from_world,
                             const Matrix6& covariance, const Fix& fix);
  void begin(Job& job);
  bool track(Job& job, const PosePrediction& predicted);
  bool correct(Job& job, Found found);
  static std::vector<Refined> branches_of(const Refined& tracked, const Found& found,
                                          const Scene& scene, RefineOptions options);
  bool weigh_branches(const Job& job, const PredictedCamera& camera, const Found& found,
                      const RefineOptions& options, const Refined& tracked, PoseObservation& seen);
  std::vector<Blob> detect_at(Job& job, const std::vector<ExpectedLamp>& expected) const;
  bool search(Job& job, const PosePrediction& predicted);
  bool use_fix(Job& job, const PosePrediction& predicted, const Fix& fix);
  bool confirm(Job& job, const PosePrediction& predicted, const Jump& jump, const Fix& fix);
  bool agrees_with_jumps(const Jump& jump) const;
  void begin_at_jumps();
  static double seen_at(const Fix& fix, const Job& job);
  Prior lasting_prior(const Job& job) const;
  Result<Fix> locate_in(Job& job, const std::optional<Prior>& prior) const;
  void protect(Job& job, const PredictedCamera& camera, const Found& found, const Refined& tracked);
  void set_tracking(const Job& job);
  void recall_looks(const Job& job, std::vector<ExpectedLamp>& expected) const;
  void set_unseen(Job& job, const PosePrediction& predicted);
  void fill_pose(Job& job) const;

  TrackerOptions options_;
  DetectOptions detect_;
  std::vector<CameraState> views_;
  MotionFilter filter_;
  SystematicErrors systematic_;
  IntegrityMonitor integrity_;
  TrackerState state_ = TrackerState::searching;
  double last_seen_s_ = -std::numeric_limits<double>::infinity();
  std::vector<Jump> jumps_;  // of consecutive images, which agree with each other
  int images_until_check_ = 0;
  bool sizes_next_ = false;  // measure the sizes of the lamps in the next image
};

}  // namespace occ::internal::track
