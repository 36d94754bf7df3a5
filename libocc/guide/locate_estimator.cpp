// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <deque>
#include <utility>

#include "libocc/geometry/perturbation.hpp"
#include "libocc/geometry/pose_observation.hpp"
#include "libocc/guide/loop_estimator.hpp"
#include "libocc/locate/locate.hpp"

namespace occ {
namespace {

// Uncertainty of height and tilt on the floor.
constexpr double height_sigma_m = 1e-3, tilt_sigma_rad = 1e-3;
constexpr double coast_s = 1;           // maximum duration of prediction without an image
constexpr double model_sigma_m = 1e-4;  // lower bound of the uncertainty of a pose
constexpr double history_s = 2;

struct PredictedPose {
  double time_s = 0;
  PlanarPose pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

Eigen::Matrix2d axes_of(const PlanarPose& pose) {
  Eigen::Matrix2d axes;
  axes << pose.forward(), pose.left();
  return axes;
}

/// Returns the first `share` of a step; the lateral part is scaled as well.
PlanarOdometry part_of(const PlanarOdometry& step, double share) {
  const double turn = step.increment.heading_rad;
  const double length = step.increment.x_m / arc(1, turn).x_m;
  PlanarOdometry part = step;
  part.increment = arc(share * length, share * turn);
  part.increment.y_m += share * (step.increment.y_m - arc(length, turn).y_m);
  part.covariance = share * step.covariance;
  part.to_s = step.from_s + share * (step.to_s - step.from_s);
  return part;
}

PredictedPose moved(const PredictedPose& from, const PlanarOdometry& step) {
  const Eigen::Matrix2d axes = axes_of(from.pose);
  Eigen::Matrix3d by_pose = Eigen::Matrix3d::Identity(), by_step = Eigen::Matrix3d::Identity();
  const Eigen::Vector2d shift = axes * step.increment.position();
  by_pose.topRightCorner<2, 1>() << -shift.y(), shift.x();
  by_step.topLeftCorner<2, 2>() = axes;
  return {step.to_s, from.pose * step.increment,
          by_pose * from.covariance * by_pose.transpose() +
              by_step * step.covariance * by_step.transpose()};
}

PriorPose prior_of(const PredictedPose& estimate, const Rigid3& cam_from_body) {
  Matrix6 parts = Matrix6::Zero();
  parts.topLeftCorner<3, 3>() = estimate.covariance;
  parts.diagonal().head<3>().array() += model_sigma_m * model_sigma_m;
  parts(3, 3) = parts(4, 4) = tilt_sigma_rad * tilt_sigma_rad;
  parts(5, 5) = height_sigma_m * height_sigma_m;
  const Matrix6 jacobian = adjoint(cam_from_body) * planar_perturbation(estimate.pose);
  return {cam_from_body * body_from_world(estimate.pose), jacobian * parts * jacobian.transpose()};
}

/// Planar part of a fix.
PredictedPose planar_part(const Fix& fix, const Rigid3& cam_from_body, double time_s) {
  const Rigid3 body = cam_from_body.inverse() * fix.cam_from_world;
  PredictedPose estimate{time_s, planar_pose(body), {}};
  const Matrix6 carry = adjoint(cam_from_body.inverse());
  estimate.covariance =
      planar_covariance(estimate.pose, carry * fix.covariance * carry.transpose());
  return estimate;
}

class LocateEstimator : public LoopEstimator {
 public:
  explicit LocateEstimator(const Scene& scene) : scene_(scene) {}

  void start(double time_s, const PlanarPose& pose, const Eigen::Matrix3d& covariance) override {
    estimate_ = {time_s, pose, covariance};
    steps_.clear();
    started_ = true;
  }

  void add_odometry(const PlanarOdometry& step) override {
    steps_.push_back(step);
    while (steps_.size() > 2 && step.to_s - steps_.front().to_s > history_s) {
      // older than any image that can still arrive
      if (steps_.front().to_s > estimate_.time_s) estimate_ = predicted(steps_.front().to_s);
      steps_.pop_front();
    }
  }

  EstimatedPose add_image(const CapturedFrame& frame) override {
    last_.relocated = false;
    if (frame.captured_s < estimate_.time_s - 1e-9 || frame.captured_s > frame.now_s + 1e-9) {
      last_.reason = "skipped an image that is older than the previous one or from the future";
      return at(frame.now_s);
    }
    const PredictedPose before = predicted(frame.captured_s);
    LocateOptions options;
    if (started_) {
      options.prior.emplace();
      options.prior->last_pose = prior_of(before, frame.cam_from_body);
    }
    const Result<Fix> fix = locate(frame.image, scene_, options);
    last_.reason = fix.message;
    last_.lamps = static_cast<int>(fix->lamps.size());
    if (!fix.ok()) return at(frame.now_s);
    estimate_ = planar_part(fix.value, frame.cam_from_body, frame.captured_s);
    fixed_s_ = frame.captured_s;
    started_ = true;
    return at(frame.now_s);
  }

  EstimatedPose at(double time_s) const override {
    const PredictedPose pose = predicted(time_s);
    EstimatedPose estimate = last_;
    estimate.time_s = time_s;
    estimate.pose = pose.pose;
    estimate.covariance = pose.covariance;
    if (!started_) {
      estimate.state = TrackerState::searching;
    } else if (time_s - fixed_s_ <= frame_gap_s) {
      estimate.state = TrackerState::tracking;
    } else {
      estimate.state = time_s - fixed_s_ <= coast_s ? TrackerState::coasting : TrackerState::lost;
    }
    return estimate;
  }

 private:
  static constexpr double frame_gap_s = 0.15;

  PredictedPose predicted(double time_s) const {
    PredictedPose estimate = estimate_;
    for (const PlanarOdometry& step : steps_) {
      if (step.to_s <= estimate.time_s + 1e-12) continue;
      if (step.from_s >= time_s - 1e-12) break;
      const double length_s = step.to_s - step.from_s;
      PlanarOdometry rest = step;
      if (step.from_s < estimate.time_s) {  // the time of the estimate is within the step
        const PlanarOdometry done = part_of(step, (estimate.time_s - step.from_s) / length_s);
        rest.increment = done.increment.inverse() * step.increment;
        rest.covariance *= (step.to_s - estimate.time_s) / length_s;
        rest.from_s = estimate.time_s;
      }
      if (step.to_s > time_s)
        rest = part_of(rest, (time_s - rest.from_s) / (rest.to_s - rest.from_s));
      estimate = moved(estimate, rest);
    }
    estimate.time_s = std::max(estimate.time_s, time_s);
    return estimate;
  }

  Scene scene_;
  PredictedPose estimate_;
  std::deque<PlanarOdometry> steps_;
  EstimatedPose last_;
  double fixed_s_ = -1e9;
  bool started_ = false;
};

}  // namespace

std::unique_ptr<LoopEstimator> make_locate_estimator(const Scene& scene) {
  return std::make_unique<LocateEstimator>(scene);
}

}  // namespace occ
