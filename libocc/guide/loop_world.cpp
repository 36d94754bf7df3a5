// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/internal/loop_world.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/geometry/motion.hpp"
#include "libocc/geometry/so3.hpp"
#include "libocc/guide/mount.hpp"

namespace occ::internal::guide {
namespace {

constexpr double clock_s = 1e-9;  // tolerance for rounding of times [s]
constexpr int flicker_phases = 16;

double towards(double now, double aim, double most) {
  return now + std::clamp(aim - now, -most, most);
}

/// Distortion coefficients that the camera does not have are added.
Camera real_camera(const Camera& assumed, const std::map<std::string, double>& errors) {
  std::map<std::string, double> any_sigma;
  for (const auto& [name, error] : errors) any_sigma[name] = 1;
  try {
    const Camera camera = assumed.with_parameter_sigmas(any_sigma);
    const std::vector<CameraParameter> parameters = camera.parameters();
    Eigen::VectorXd values(static_cast<Eigen::Index>(parameters.size()));
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const auto error = errors.find(parameters[i].name);
      values[static_cast<Eigen::Index>(i)] =
          parameters[i].value + (error == errors.end() ? 0 : error->second);
    }
    return camera.with_parameters(values);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string("world.lens: ") + error.what());
  }
}

Scene real_scene(const Scene& assumed, const WorldErrors& world, std::uint64_t seed) {
  Scene real = assumed;
  if (!world.lens.empty()) real.camera = real_camera(assumed.camera, world.lens);
  Random random(seed, 4);
  if (world.map_sigma_m > 0)
    for (Lamp& lamp : real.lamps)
      for (double& coordinate : lamp.centre_m) coordinate += world.map_sigma_m * random.normal();
  real.sensor.exposure_s *= world.exposure;
  real.ambient_w_m2 += world.ambient_w_m2;
  return real;
}

}  // namespace

LoopWorld::LoopWorld(const Scene& scene, const LoopOptions& options, const PlanarPose& start)
    : scene_(real_scene(scene, options.world, options.seed)),
      options_(options),
      driving_(options.seed, 1),
      frames_(options.seed, 2) {
  const WorldErrors& world = options.world;
  mount_error_.rotation = so3_exp(world.mount_rotation_rad);
  mount_error_.translation = -(mount_error_.rotation * world.mount_shift_m);
  Random floor(options.seed, 5);
  for (double& phase : floor_phases_rad_) phase = floor.uniform(0, 2 * pi);
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
  capture.stamped_s = capture.captured_s + options_.world.clock_s;
  for (const ClockJump& jump : options_.faults.clock_jumps)
    if (capture.captured_s >= jump.at_s) capture.stamped_s += jump.by_s;
  // Drawn for every image, so that one option does not change the effect of another.
  const double loss = frames_.uniform(), repeat = frames_.uniform();
  capture.lost = loss < options_.faults.frame_loss;
  capture.times = repeat < options_.faults.frame_repeat ? 2 : 1;

  const Rigid3 body_before = real_body(before.pose), body_after = real_body(state_.pose);
  const Rigid3 body =
      moved_pose(body_before, velocity_between(body_before, body_after, dt_s), share * dt_s);
  const auto mount = [&](double s) {
    return camera_on_vehicle(options_.camera_place_m, pan_before + s * (pan_rad_ - pan_before),
                             tilt_before + s * (tilt_rad_ - tilt_before));
  };
  capture.cam_from_body = mount(share);
  capture.dark = dark_lamps(capture.captured_s);
  if (!capture.lost)
    render(capture, number, mount_error_ * capture.cam_from_body * body,
           velocity_between(mount_error_ * mount(0) * body_before,
                            mount_error_ * mount(1) * body_after, dt_s));
  in_transit_.push_back(std::move(capture));
}

/// body_from_world on the floor's waves.
Rigid3 LoopWorld::real_body(const PlanarPose& pose) const {
  const WorldErrors& world = options_.world;
  const Rigid3 even = body_from_world(pose);
  if (!(world.floor_tilt_rad > 0 || world.floor_height_m > 0)) return even;
  const Eigen::Vector2d at = 2 * pi / world.floor_wave_m * pose.position();
  const auto& phase = floor_phases_rad_;
  const double roll_rad =
      world.floor_tilt_rad * std::sin(at.x() + phase[0]) * std::cos(0.7 * at.y() + phase[1]);
  const double pitch_rad =
      world.floor_tilt_rad * std::sin(1.1 * at.y() + phase[2]) * std::cos(0.8 * at.x() + phase[3]);
  const double height_m = world.floor_height_m * std::sin(0.7 * (at.x() + at.y()) + phase[4]);
  const Rigid3 tilt{so3_exp({roll_rad, pitch_rad, 0}), Eigen::Vector3d::Zero()};
  Rigid3 raised = even;
  raised.translation.z() -= height_m;
  return tilt * raised;
}

int LoopWorld::flicker_phase(double time_s) const {
  const WorldErrors& world = options_.world;
  if (!(world.ambient_flicker > 0 && world.ambient_w_m2 > 0)) return 0;
  const double turns = world.flicker_hz * (time_s + scene_.sensor.exposure_s / 2);
  return static_cast<int>(flicker_phases * (turns - std::floor(turns))) % flicker_phases;
}

Renderer& LoopWorld::renderer_of(const std::vector<int>& dark, int phase) {
  const auto known = renderers_.find({dark, phase});
  if (known != renderers_.end()) return known->second;
  Scene lit = scene_;
  const auto is_dark = [&](const Lamp& lamp) {
    return std::binary_search(dark.begin(), dark.end(), lamp.id);
  };
  lit.lamps.erase(std::remove_if(lit.lamps.begin(), lit.lamps.end(), is_dark), lit.lamps.end());
  const WorldErrors& world = options_.world;
  lit.ambient_w_m2 +=
      world.ambient_flicker * world.ambient_w_m2 * std::sin(2 * pi * phase / flicker_phases);
  return renderers_.emplace(std::make_pair(dark, phase), Renderer(lit)).first->second;
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
  renderer_of(capture.dark, flicker_phase(capture.captured_s))
      .render(cam_from_world, how, capture.rendered);
  for (const LampTruth& lamp : capture.rendered.lamps) capture.lamps_in_view += lamp.whole ? 1 : 0;
}

std::vector<Capture> LoopWorld::arrived() {
  std::vector<Capture> captures;
  const double transport_s = std::max(options_.faults.latency_s, options_.world.clock_s);
  while (!in_transit_.empty() &&
         in_transit_.front().captured_s + transport_s <= state_.time_s + clock_s) {
    captures.push_back(std::move(in_transit_.front()));
    in_transit_.pop_front();
  }
  return captures;
}

void LoopWorld::recycle(Capture capture) {
  if (!capture.lost) spare_[capture.dark].push_back(std::move(capture.rendered));
}

}  // namespace occ::internal::guide
