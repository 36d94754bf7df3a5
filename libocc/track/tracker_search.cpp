// SPDX-License-Identifier: Apache-2.0
// Search of the whole image by the tracker, and the confirmation of poses that were not predicted.
#include <cmath>
#include <sstream>
#include <utility>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/math.hpp"
#include "libocc/core/statistics.hpp"
#include "libocc/refine/internal/error_gradient.hpp"
#include "libocc/track/internal/tracker_impl.hpp"

namespace occ::internal::track {

namespace {

/// Standard deviation of a lamp's place in an image that an unknown motion of the camera bends.
constexpr double bent_sigma_px = 2;

Matrix6 inflated(Matrix6 covariance, double sigma_rad, double sigma_m) {
  covariance.diagonal().head<3>().array() += square(sigma_rad);
  covariance.diagonal().tail<3>().array() += square(sigma_m);
  return covariance;
}

bool agree(const Rigid3& a, const Rigid3& b, const Matrix6& covariance, double gate_sigma) {
  const Vector6 apart = difference(a, b);
  return apart.dot(core::solve_llt(covariance, apart)) <= gate_chi2(gate_sigma, 6);
}

/// Covariance of body_from_world, from that of cam_from_world.
Matrix6 body_covariance(const Matrix6& covariance, const Rigid3& cam_from_body) {
  const Matrix6 moves = adjoint(cam_from_body.inverse());
  return moves * covariance * moves.transpose();
}

}  // namespace

/// Prior for any time: height and tilt of the camera, from the options or from the floor.
Prior TrackerImpl::lasting_prior(const Job& job) const {
  Prior lasting;
  if (const std::optional<Prior>& given = options_.locate.prior) {
    lasting.height_m = given->height_m;
    lasting.height_sigma_m = given->height_sigma_m;
    lasting.gravity_in_cam = given->gravity_in_cam;
    lasting.gravity_sigma_rad = given->gravity_sigma_rad;
  }
  if (!options_.floor) return lasting;
  const Rigid3 upright_cam = job.cam_from_body * body_from_world({}, options_.floor->height_m);
  lasting.height_m = upright_cam.origin_in_source().z();
  lasting.height_sigma_m = options_.floor->height_sigma_m;
  lasting.gravity_in_cam = -job.cam_from_body.rotation.col(2);
  lasting.gravity_sigma_rad = options_.floor->tilt_sigma_rad;
  return lasting;
}

Result<Fix> TrackerImpl::locate_in(Job& job, const std::optional<Prior>& prior) const {
  LocateOptions options = options_.locate;
  options.prior = prior && !prior->empty() ? prior : std::nullopt;
  Result<Fix> fix = occ::locate(job.image, job.view.scene, options);
  if (fix.status == Status::no_pose && job.view.scene.sensor.row_time_s > 0) {
    // The camera's motion during the readout bends the image; rims would reject every pose.
    options.detect.rims = false;
    options.refine.model_sigma_px = std::max(options.refine.model_sigma_px, bent_sigma_px);
    options.identify.model_sigma_px = std::max(options.identify.model_sigma_px, bent_sigma_px);
    fix = occ::locate(job.image, job.view.scene, options);
  }
  if (fix.ok() && fix->found_colour)
    for (Lamp& lamp : job.view.scene.lamps) lamp.colour = *fix->found_colour;
  job.frame.full_search = true;
  job.frame.timing_s.detect_s += fix->timing_s.detect_s;
  job.frame.timing_s.identify_s += fix->timing_s.identify_s;
  job.frame.timing_s.refine_s += fix->timing_s.refine_s;
  return fix;
}

/// Mean time of the lines that show a fix's lamps.
double TrackerImpl::seen_at(const Fix& fix, const Job& job) {
  double sum_s = 0;
  for (const auto& [id, blob] : fix.lamps)
    sum_s += readout_delay_s(job.view.scene.sensor, blob.centroid_px);
  return job.frame.time_s + sum_s / static_cast<double>(std::max<std::size_t>(1, fix.lamps.size()));
}

bool TrackerImpl::has_systematic(const Job& job) const {
  return !job.view.is_exact || systematic_.has_own();
}

void TrackerImpl::add_systematic(const Job& job, const PredictedCamera& camera,
                                 const Refined& refined, const Found& found,
                                 const RefineOptions& options, PoseObservation& seen) {
  const Scene& scene = job.view.scene;
  if (!job.view.is_exact)
    systematic_.add_scene(refine::error_gradient(refined, found.blobs, scene, options), scene,
                          job.frame.camera, seen);
  systematic_.add_own(job.frame.camera, camera.velocity, seen);
}

TrackerImpl::Found TrackerImpl::found_by(const Fix& fix, const Scene& scene) {
  Found found;
  for (std::size_t i = 0; i < scene.lamps.size(); ++i) {
    const auto lamp = fix.lamps.find(scene.lamps[i].id);
    if (lamp == fix.lamps.end()) continue;
    found.matches.push_back({static_cast<int>(i), static_cast<int>(found.blobs.size())});
    found.blobs.push_back(lamp->second);
  }
  return found;
}

/// Starts at a pose of low weight, so that the lamps' systematic errors are those of the next
/// images, and corrects it by the lamps.
bool TrackerImpl::begin_with_systematic(Job& job, double time_s, const Rigid3& body_from_world,
                                        const Matrix6& covariance, const Fix& fix) {
  constexpr double low_weight = 100;
  const double speed_m_s = options_.floor ? options_.floor->start_speed_sigma_m_s
                                          : options_.filter.start_speed_sigma_m_s;
  const double shift_m = options_.mount_sigma_m + options_.clock_sigma_s * speed_m_s;
  const Matrix6 wide = low_weight * inflated(covariance, options_.mount_sigma_rad, shift_m);
  filter_.start(time_s, body_from_world, wide);
  if (correct(job, found_by(fix, job.view.scene))) return true;
  filter_.start(time_s, body_from_world, covariance);
  return false;
}

void TrackerImpl::begin(Job& job) {
  Prior prior = options_.locate.prior.value_or(Prior{});
  if (options_.floor) {
    const Prior lasting = lasting_prior(job);
    prior.height_m = lasting.height_m;
    prior.height_sigma_m = lasting.height_sigma_m;
    prior.gravity_in_cam = lasting.gravity_in_cam;
    prior.gravity_sigma_rad = lasting.gravity_sigma_rad;
  }
  const Result<Fix> fix = locate_in(job, prior);
  if (!fix.ok()) {
    job.frame.reason = fix.message.empty() ? to_string(fix.status) : fix.message;
    return;
  }
  job.seen_s = seen_at(*fix, job);
  const Rigid3 body = job.cam_from_body.inverse() * fix->cam_from_world;
  const Matrix6 covariance = body_covariance(fix->covariance, job.cam_from_body);
  if (has_systematic(job)) {
    if (begin_with_systematic(job, job.seen_s, body, covariance, *fix)) return;
  } else {
    filter_.start(job.seen_s, body, covariance);
  }
  job.frame.lamps = fix->lamps;
  set_tracking(job);
}

bool TrackerImpl::search(Job& job, const PosePrediction& predicted) {
  if (std::exchange(job.searched, true)) return false;
  const PredictedCamera camera = camera_at(predicted, job);
  Prior near = lasting_prior(job);
  near.last_pose =
      PriorPose{camera.cam_from_world,
                inflated(camera.covariance, options_.drift_sigma_rad, options_.drift_sigma_m)};
  Result<Fix> fix = locate_in(job, near);
  if (!fix.ok()) fix = locate_in(job, lasting_prior(job));
  if (fix.ok()) return use_fix(job, predicted, *fix);
  job.frame.reason = fix.message.empty() ? to_string(fix.status) : fix.message;
  jumps_.clear();
  return false;
}

/// Corrects the filter with a fix inside the gate of the prediction; any other must be confirmed.
bool TrackerImpl::use_fix(Job& job, const PosePrediction& predicted, const Fix& fix) {
  const Rigid3 body = job.cam_from_body.inverse() * fix.cam_from_world;
  const Matrix6 covariance = inflated(body_covariance(fix.covariance, job.cam_from_body),
                                      options_.mount_sigma_rad, options_.mount_sigma_m);
  if (agree(body, predicted.body_from_world, predicted.covariance + covariance,
            filter_.gate_sigma())) {
    if (correct(job, found_by(fix, job.view.scene))) return true;
  }
  job.frame.lamps = fix.lamps;
  return confirm(job, predicted, {seen_at(fix, job), body, covariance}, fix);
}

bool TrackerImpl::agrees_with_jumps(const Jump& jump) const {
  if (jumps_.empty()) return true;
  const Jump& last = jumps_.back();
  const double dt = jump.time_s - last.time_s;
  const Matrix6 apart =
      inflated(jump.covariance + last.covariance, options_.filter.start_turn_sigma_rad_s * dt,
               options_.filter.start_speed_sigma_m_s * dt);
  return agree(jump.body_from_world, last.body_from_world, apart, filter_.gate_sigma());
}

/// Starts the filter at the first jump; the following ones determine the velocity.
void TrackerImpl::begin_at_jumps() {
  const Jump& first = jumps_.front();
  filter_.start(first.time_s, first.body_from_world, first.covariance);
  for (std::size_t i = 1; i < jumps_.size(); ++i)
    filter_.add(PoseObservation::of_pose(jumps_[i].time_s, jumps_[i].body_from_world,
                                         jumps_[i].covariance));
}

bool TrackerImpl::confirm(Job& job, const PosePrediction& predicted, const Jump& jump,
                          const Fix& fix) {
  const double away_m =
      (jump.body_from_world.origin_in_source() - predicted.body_from_world.origin_in_source())
          .norm();
  if (!agrees_with_jumps(jump)) jumps_.clear();
  jumps_.push_back(jump);
  std::ostringstream text;
  text << "seen " << std::round(1e3 * away_m) / 1e3 << " m from where it was expected";
  const int seen_so_far = static_cast<int>(jumps_.size());
  if (seen_so_far < options_.confirmations) {
    text << ": " << seen_so_far << " of " << options_.confirmations << " images that must agree";
    job.frame.reason = text.str();
    return false;
  }
  job.seen_s = jump.time_s;
  integrity_.clear();
  if (has_systematic(job))
    begin_with_systematic(job, jump.time_s, jump.body_from_world, jump.covariance, fix);
  else
    begin_at_jumps();
  text << ", confirmed by " << options_.confirmations << " images";
  job.frame.reason = text.str();
  job.frame.relocated = true;
  set_tracking(job);
  return true;
}

}  // namespace occ::internal::track
