// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/closed_loop.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

#include "libocc/core/require.hpp"
#include "libocc/guide/internal/clock_guard.hpp"
#include "libocc/guide/internal/loop_metrics.hpp"
#include "libocc/guide/internal/loop_world.hpp"
#include "libocc/guide/mount.hpp"

namespace occ {

using namespace internal::guide;
namespace {

class Loop {
 public:
  Loop(const Scene& scene, const Route& route, const LoopOptions& options,
       std::unique_ptr<LoopEstimator> estimator)
      : scene_(scene),
        route_(route),
        options_(options),
        world_(scene, options, options.start.value_or(route.at(0).pose)),
        estimator_(std::move(estimator)),
        clock_(options.clock_guard_s) {
    true_along_m_ = route.nearest(world_.state().pose.position(), 0.0, route.lap_m() / 2).along_m;
    start_estimate();
  }

  LoopResult run(const LoopObserver& observer) && {
    while (!ended()) {
      step();
      if (observer && !observer(result_.records.back()))
        end(LoopOutcome::out_of_time, "ended by the observer");
    }
    result_.metrics = summarise(result_, route_, options_);
    return std::move(result_);
  }

 private:
  bool ended() const { return ended_; }

  void end(LoopOutcome outcome, const std::string& message) {
    if (ended_) return;
    ended_ = true;
    result_.outcome = outcome;
    result_.message = message;
  }

  void start_estimate() {
    Random random(options_.seed, 3);
    const Eigen::Vector3d sigmas(options_.start_sigma_m, options_.start_sigma_m,
                                 options_.start_sigma_rad);
    PlanarPose pose = world_.state().pose;
    pose.x_m += sigmas[0] * random.normal();
    pose.y_m += sigmas[1] * random.normal();
    pose.heading_rad = wrapped_rad(pose.heading_rad + sigmas[2] * random.normal());
    estimator_->start(0, pose, Eigen::Matrix3d(sigmas.cwiseAbs2().asDiagonal()));
    estimate_ = estimator_->at(0);
  }

  void step() {
    const double dt_s = 1 / options_.control_rate_hz;
    LoopRecord record;
    record.command = command();
    estimator_->add_odometry(world_.step(record.command, pan_tilt_setpoint(), dt_s));
    record.frames = take_images();
    estimate_ = estimator_->at(world_.state().time_s);
    fill(record);
    result_.records.push_back(record);
    end_if_due(record);
  }

  PanTiltKnot pan_tilt_setpoint() const {
    if (options_.pan_tilt) return options_.pan_tilt->at(along_m_.value_or(0));
    return {0, options_.camera_pan_rad, options_.camera_tilt_rad};
  }

  bool is_alert() const {
    const std::optional<double>& limit_m = options_.tracker.alert_limit_m;
    return limit_m && !(estimate_.protection_level_m <= *limit_m);
  }

  bool may_drive() const { return estimate_.has_pose() && !is_alert(); }

  /// Computes the command from the estimate only.
  DriveCommand command() {
    if (!may_drive()) return {};
    const DriveState& state = world_.state();  // speed and turn rate are measured at the wheels
    if (docking_) return dock_command(state.speed_m_s);
    const ControlInput input{estimate_.pose, state.speed_m_s, state.turn_rate_rad_s, along_m_};
    const ControlOutput output =
        options_.follower == Follower::pure_pursuit
            ? pure_pursuit(route_, options_.vehicle, input, options_.pure_pursuit)
            : stanley(route_, options_.vehicle, input, options_.stanley);
    command_limited_ = output.speed_limited || output.curve_limited;
    along_m_ = output.place.along_m;
    if (!output.at_end) return output.command;
    docking_ = true;
    return route_.dock() ? dock_command(state.speed_m_s) : DriveCommand{};
  }

  DriveCommand dock_command(double speed_m_s) {
    if (!route_.dock()) return {};
    const DockOutput output =
        dock(estimate_.pose, speed_m_s, *route_.dock(), options_.vehicle, phase_, options_.docking);
    phase_ = output.phase;
    command_limited_ = output.speed_limited || output.curve_limited;
    return output.command;
  }

  int take_images() {
    int count = 0;
    for (Capture& capture : world_.arrived()) {
      if (capture.lost) {
        result_.frames.push_back(
            {capture.captured_s, world_.state().time_s, true, {}, 0, 0, 0, 0, false, 0});
        continue;
      }
      for (int i = 0; i < capture.times; ++i, ++count) take_image(capture);
      world_.recycle(std::move(capture));
    }
    return count;
  }

  void take_image(const Capture& capture) {
    LoopFrame frame;
    frame.captured_s = capture.captured_s;
    frame.arrived_s = world_.state().time_s;
    frame.lamps_in_view = capture.lamps_in_view;
    const double captured_s = clock_.captured_s(capture.stamped_s, frame.arrived_s);
    frame.clock_jumped_s = clock_.jumped_s();
    const auto begin = std::chrono::steady_clock::now();
    const EstimatedPose seen = estimator_->add_image(
        {capture.rendered.image.view(), captured_s, frame.arrived_s, capture.cam_from_body});
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - begin;
    frame.taken_s = taken.count();
    frame.state = seen.state;
    frame.lamps_used = seen.lamps;
    frame.nis = seen.nis;
    frame.nis_dof = seen.nis_dof;
    frame.relocated = seen.relocated;
    if (seen.relocated && along_m_)
      along_m_ = route_.nearest(seen.pose.position(), along_m_, route_.lap_m() / 2).along_m;
    result_.frames.push_back(frame);
  }

  void fill(LoopRecord& record) {
    const DriveState& state = world_.state();
    const bool jumped = !result_.records.empty() &&
                        (state.pose.position() - result_.records.back().truth.position()).norm() >
                            0.25 * jump_window_m;
    const RoutePlace place = route_.nearest(state.pose.position(), true_along_m_,
                                            jumped ? route_.lap_m() / 2 : jump_window_m);
    true_along_m_ = place.along_m;
    record.time_s = state.time_s;
    record.truth = state.pose;
    record.estimate = estimate_;
    record.along_m = place.along_m;
    record.deviation_m = place.deviation_m;
    record.limited = world_.limited();
    record.limited.speed = record.limited.speed || command_limited_;
    record.pan_rad = world_.pan_rad();
    record.tilt_rad = world_.tilt_rad();
    record.docking = docking_;
    record.alert = is_alert();
  }

  void end_if_due(const LoopRecord& record) {
    std::string what;
    const Eigen::Vector2d place = record.truth.position();
    if (clearance_m(scene_, place, options_.vehicle.radius_m, options_.vehicle_height_m, &what) <
        0) {
      std::ostringstream text;
      text << "touched " << what << " at (" << place.x() << ", " << place.y() << ") after "
           << record.time_s << " s";
      end(LoopOutcome::collision, text.str());
    }
    if (may_drive()) had_pose_s_ = record.time_s;
    if (record.time_s - had_pose_s_ > options_.max_lost_s) {
      what = estimate_.has_pose() ? "no protection level below the alert limit" : "no pose";
      what += " for " + std::to_string(options_.max_lost_s) + " s";
      if (!record.estimate.reason.empty()) what += ": " + record.estimate.reason;
      end(LoopOutcome::lost, what);
    }
    const bool there = route_.dock() ? phase_ == DockPhase::docked : docking_;
    if (there && world_.state().speed_m_s == 0 && world_.state().turn_rate_rad_s == 0)
      end(LoopOutcome::arrived, route_.dock() ? "docked" : "at the route's end");
    if (record.time_s >= options_.max_s)
      end(LoopOutcome::out_of_time,
          "not at the end after " + std::to_string(options_.max_s) + " s");
  }

  static constexpr double jump_window_m = 0.5;  // longer than the distance of any control step

  const Scene& scene_;
  const Route& route_;
  const LoopOptions& options_;
  LoopWorld world_;
  std::unique_ptr<LoopEstimator> estimator_;
  ClockGuard clock_;
  EstimatedPose estimate_;
  std::optional<double> along_m_ = 0;
  double true_along_m_ = 0, had_pose_s_ = 0;
  DockPhase phase_ = DockPhase::approach;
  bool docking_ = false, command_limited_ = false, ended_ = false;
  LoopResult result_;
};

void require_lamps(const Scene& scene, const LoopFaults& faults) {
  for (std::size_t i = 0; i < faults.lamp_failures.size(); ++i) {
    const int id = faults.lamp_failures[i].lamp;
    const bool known = std::any_of(scene.lamps.begin(), scene.lamps.end(),
                                   [&](const Lamp& lamp) { return lamp.id == id; });
    require(known, "lamp_failures[" + std::to_string(i) + "].lamp", id, "the id of a lamp");
  }
}

std::unique_ptr<LoopEstimator> estimator_of(const Scene& scene, const LoopOptions& options) {
  if (options.estimation == LoopEstimation::locate) return make_locate_estimator(scene);
  return make_tracker_estimator(
      scene, options.tracker,
      camera_on_vehicle(options.camera_place_m, options.camera_pan_rad, options.camera_tilt_rad));
}

}  // namespace

const char* to_string(LoopOutcome outcome) {
  switch (outcome) {
    case LoopOutcome::arrived:
      return "arrived";
    case LoopOutcome::collision:
      return "collision";
    case LoopOutcome::lost:
      return "lost";
    case LoopOutcome::out_of_time:
      return "out_of_time";
  }
  return "unknown";
}

LoopResult closed_loop(const Scene& scene, const Route& route, const LoopOptions& options,
                       const MakeEstimator& make_estimator, const LoopObserver& observer) {
  options.validate();
  Scene checked = scene;
  checked.validate();
  require_lamps(checked, options.faults);
  require_free(route, checked, options.vehicle.radius_m, options.vehicle_height_m);
  if (options.start)
    require(clearance_m(checked, options.start->position(), options.vehicle.radius_m,
                        options.vehicle_height_m) >= 0,
            "start", options.start->position().transpose(), "free of walls and boxes");
  std::unique_ptr<LoopEstimator> estimator =
      make_estimator ? make_estimator(checked) : estimator_of(checked, options);
  require(estimator != nullptr, "make_estimator", "none", "a function that returns an estimator");
  return Loop(checked, route, options, std::move(estimator)).run(observer);
}

}  // namespace occ
