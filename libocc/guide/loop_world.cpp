// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/internal/loop_world.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "libocc/geometry/motion.hpp"
#include "libocc/guide/mount.hpp"

namespace occ::internal::guide {
namespace {

constexpr double clock_s = 1e-9;  // tolerance for rounding of times [s]

double towards(double now, double aim, double most) {
  return now + std::clamp(aim - now, -most, most);
}

}  // namespace

LoopWorld::LoopWorld(const Scene& scene, const LoopOptions& options, const PlanarPose& start)
    : scene_(scene), options_(options), driving_(options.seed, 1), frames_(options.seed, 2) {
  state_.pose = start;
  pan_rad_ = options.camera_pan_rad;
  tilt_rad_ = options.camera_tilt_rad;
  if (!options.pan_tilt) return;
  pan_rad_ = options.pan_tilt->at(0).pan_rad;
  tilt_rad_ = options.pan_tilt->at(0).tilt_rad;
}

PlanarOdometry LoopWorld::step(const DriveCommand& command, const PanTiltKnot& aim, double dt_s) {
  const DriveState before = state_;
  const double pan_before = pan_rad_, tilt_before = tilt_rad_;
  const DriveStep driven = drive(options_.vehicle, state_, command, dt_s, driving_);
  state_ = driven.state;
  limited_ = driven.limited;
  turn_camera(aim, dt_s);
  const double rate = options_.frame_rate_hz;
  for (; next_frame_ / rate <= state_.time_s + clock_s; ++next_frame_) {
    const double share = (next_frame_ / rate - before.time_s) / dt_s;
    capture(next_frame_, before, pan_before, tilt_before, std::clamp(share, 0.0, 1.0));
  }
  kidnap(before.time_s);
  return with_faults(driven.odometry);
}

void LoopWorld::turn_camera(const PanTiltKnot& aim, double dt_s) {
  const double most = options_.pan_tilt_rate_rad_s * dt_s;
  pan_rad_ = towards(pan_rad_, aim.pan_rad, most);
  tilt_rad_ = towards(tilt_rad_, aim.tilt_rad, most);
}

void LoopWorld::kidnap(double from_s) {
  for (const Kidnapping& kidnapping : options_.faults.kidnappings) {
    if (kidnapping.at_s < from_s || kidnapping.at_s >= state_.time_s) continue;
    state_.pose = kidnapping.to;
    state_.speed_m_s = state_.turn_rate_rad_s = 0;
  }
}

PlanarOdometry LoopWorld::with_faults(PlanarOdometry step) const {
  for (const OdometryFault& fault : options_.faults.odometry_faults) {
    if (step.to_s <= fault.from_s || step.from_s >= fault.to_s) continue;
    const double turn = step.increment.heading_rad;
    const double length = step.increment.x_m / arc(1, turn).x_m;
    step.increment =
        arc(fault.scale * length, turn + fault.turn_rate_rad_s * (step.to_s - step.from_s));
  }
  return step;
}

std::vector<int> LoopWorld::dark_lamps(double time_s) const {
  std::vector<int> dark;
  for (const LampFailure& failure : options_.faults.lamp_failures)
    if (time_s >= failure.from_s && time_s < failure.to_s) dark.push_back(failure.lamp);
  std::sort(dark.begin(), dark.end());
  dark.erase(std::unique(dark.begin(), dark.end()), dark.end());
  return dark;
}

void LoopWorld::capture(int number, const DriveState& before, double pan_before, double tilt_before,
                        double share) {
  const double dt_s = state_.time_s - before.time_s;
  Capture capture;
  capture.captured_s = number / options_.frame_rate_hz;
  capture.stamped_s = capture.captured_s;
  for (const ClockJump& jump : options_.faults.clock_jumps)
    if (capture.captured_s >= jump.at_s) capture.stamped_s += jump.by_s;
  // Drawn for every image, so that one option does not change the effect of another.
  const double loss = frames_.uniform(), repeat = frames_.uniform();
  capture.lost = loss < options_.faults.frame_loss;
  capture.times = repeat < options_.faults.frame_repeat ? 2 : 1;

  const Rigid3 body_before = body_from_world(before.pose),
               body_after = body_from_world(state_.pose);
  const Rigid3 body =
      moved_pose(body_before, velocity_between(body_before, body_after, dt_s), share * dt_s);
  const auto mount = [&](double s) {
    return camera_on_vehicle(options_.camera_place_m, pan_before + s * (pan_rad_ - pan_before),
                             tilt_before + s * (tilt_rad_ - tilt_before));
  };
  capture.cam_from_body = mount(share);
  capture.dark = dark_lamps(capture.captured_s);
  if (!capture.lost)
    render(capture, number, capture.cam_from_body * body,
           velocity_between(mount(0) * body_before, mount(1) * body_after, dt_s));
  in_transit_.push_back(std::move(capture));
}

Renderer& LoopWorld::renderer_without(const std::vector<int>& dark) {
  const auto known = renderers_.find(dark);
  if (known != renderers_.end()) return known->second;
  Scene lit = scene_;
  const auto is_dark = [&](const Lamp& lamp) {
    return std::binary_search(dark.begin(), dark.end(), lamp.id);
  };
  lit.lamps.erase(std::remove_if(lit.lamps.begin(), lit.lamps.end(), is_dark), lit.lamps.end());
  return renderers_.emplace(dark, Renderer(lit)).first->second;
}

void LoopWorld::render(Capture& capture, int number, const Rigid3& cam_from_world,
                       const Vector6& velocity) {
  std::vector<Rendered>& spare = spare_[capture.dark];
  if (!spare.empty()) {
    capture.rendered = std::move(spare.back());
    spare.pop_back();
  }
  SimulateOptions how;
  how.seed = options_.seed;
  how.frame = static_cast<std::uint32_t>(number);
  how.noise = options_.image_noise;
  how.noise_area = NoiseArea::around_lamps;
  how.start_s = capture.captured_s;
  how.velocity = velocity;
  renderer_without(capture.dark).render(cam_from_world, how, capture.rendered);
  for (const LampTruth& lamp : capture.rendered.lamps) capture.lamps_in_view += lamp.whole ? 1 : 0;
}

std::vector<Capture> LoopWorld::arrived() {
  std::vector<Capture> captures;
  while (!in_transit_.empty() &&
         in_transit_.front().captured_s + options_.faults.latency_s <= state_.time_s + clock_s) {
    captures.push_back(std::move(in_transit_.front()));
    in_transit_.pop_front();
  }
  return captures;
}

void LoopWorld::recycle(Capture capture) {
  if (!capture.lost) spare_[capture.dark].push_back(std::move(capture.rendered));
}

}  // namespace occ::internal::guide
