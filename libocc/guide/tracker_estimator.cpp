// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>

#include "libocc/core/require.hpp"
#include "libocc/geometry/perturbation.hpp"
#include "libocc/guide/loop_estimator.hpp"
#include "libocc/track/tracker.hpp"

namespace occ {
namespace {

constexpr double image_gap_s = 0.15;  // time without images after which the state is coasting [s]

class TrackerEstimator : public LoopEstimator {
 public:
  TrackerEstimator(const Scene& scene, const TrackerOptions& options, const Rigid3& cam_from_body)
      : options_(options), tracker_(scene, options, cam_from_body) {}

  void start(double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance) override {
    Matrix6 parts = Matrix6::Zero();
    parts.topLeftCorner<3, 3>() = covariance;
    parts(3, 3) = parts(4, 4) = std::pow(options_.floor->tilt_sigma_rad, 2);
    parts(5, 5) = std::pow(options_.floor->height_sigma_m, 2);
    const Matrix6 jacobian = planar_perturbation(pose);
    tracker_.start(time_s, body_from_world(pose, options_.floor->height_m),
                   jacobian * parts * jacobian.transpose());
    last_.pose = pose;
    last_.covariance = covariance;
    tracked_s_ = time_s;
  }

  void add_odometry(const PlanarOdometry& step) override { tracker_.add(step); }

  EstimatedPose add_image(const CapturedFrame& frame) override {
    const TrackedFrame seen =
        tracker_.add_image(frame.image, frame.captured_s, {0, frame.cam_from_body});
    last_.reason = seen.reason;
    last_.lamps = static_cast<int>(seen.lamps.size());
    last_.nis = seen.nis;
    last_.nis_dof = seen.nis_dof;
    last_.relocated = seen.relocated;
    if (seen.state == TrackerState::tracking) tracked_s_ = frame.now_s;
    EstimatedPose now = at(frame.now_s);
    if (now.has_pose()) {
      last_.pose = now.pose;
      last_.covariance = now.covariance;
    }
    return now;
  }

  EstimatedPose at(double time_s) const override {
    EstimatedPose estimate = last_;
    estimate.time_s = time_s;
    estimate.state = tracker_.state();
    const std::optional<PlanarEstimate> planar = tracker_.planar(time_s);
    if (!planar) {
      if (estimate.has_pose()) estimate.state = TrackerState::lost;
      return estimate;
    }
    estimate.pose = planar->pose;
    estimate.covariance = planar->covariance;
    estimate.protection_level_m = tracker_.protection_level_m(time_s);
    const double silent_s = time_s - tracked_s_;
    if (estimate.state != TrackerState::tracking || silent_s <= image_gap_s) return estimate;
    estimate.state =
        silent_s <= image_gap_s + options_.coast_s ? TrackerState::coasting : TrackerState::lost;
    estimate.reason = "no image has come";
    return estimate;
  }

 private:
  TrackerOptions options_;
  Tracker tracker_;
  EstimatedPose last_;
  double tracked_s_ = 0;
};

}  // namespace

TrackerOptions floor_tracker() {
  TrackerOptions options;
  options.floor.emplace();
  return options;
}

std::unique_ptr<LoopEstimator> make_tracker_estimator(const Scene& scene,
                                                      const TrackerOptions& options,
                                                      const Rigid3& cam_from_body) {
  require(options.floor.has_value(), "tracker.floor", "none", "set: the vehicle is on a floor");
  return std::make_unique<TrackerEstimator>(scene, options, cam_from_body);
}

}  // namespace occ
