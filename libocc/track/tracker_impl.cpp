// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/internal/tracker_impl.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <sstream>
#include <utility>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"
#include "libocc/geometry/motion.hpp"
#include "libocc/locate/internal/detect_options.hpp"
#include "libocc/refine/internal/scene_errors.hpp"

namespace occ::internal::track {

namespace {

/// Consecutive images with increasing times before the last accepted one, after which the clock is
/// taken to have been set back. A few late images of a congested link stay below it.
constexpr int max_late_images = 5;

Scene checked(Scene scene) {
  scene.validate();
  return scene.as_rendered();
}

MotionFilter make_filter(const TrackerOptions& options) {
  options.validate();
  return options.floor ? MotionFilter(*options.floor) : MotionFilter(options.filter);
}

double seconds_since(std::chrono::steady_clock::time_point begun) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

}  // namespace

TrackerImpl::TrackerImpl(const Scene& scene, const TrackerOptions& options,
                         const Rigid3& cam_from_body)
    : options_(options),
      detect_(options.locate.detect),
      filter_(make_filter(options)),
      systematic_(options),
      integrity_(options) {
  detect_.rims = detect_.rims && options.locate.refine.rung >= Rung::rims;
  add_camera(scene, cam_from_body);
}

int TrackerImpl::add_camera(const Scene& scene, const Rigid3& cam_from_body) {
  require(cam_from_body.rotation.allFinite() && cam_from_body.translation.allFinite(),
          "cam_from_body", cam_from_body.matrix(), "finite");
  views_.push_back({checked(scene), cam_from_body});
  CameraState& view = views_.back();
  view.is_exact = refine::is_exact(view.scene);
  return static_cast<int>(views_.size()) - 1;
}

void TrackerImpl::start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance) {
  filter_.start(time_s, body_from_world, covariance);
  state_ = TrackerState::coasting;
  last_seen_s_ = time_s;
  jumps_.clear();
  integrity_.clear();
}

TrackedFrame TrackerImpl::add_image(const ImageView& image, double time_s,
                                    const FrameSource& source) {
  const auto begun = std::chrono::steady_clock::now();
  require(source.camera >= 0 && source.camera < static_cast<int>(views_.size()), "source.camera",
          source.camera, "a camera that was added");
  require(std::isfinite(time_s), "time_s", time_s, "finite");
  image.validate();
  CameraState& view = views_[source.camera];
  const Camera& camera = view.scene.camera;
  if (image.width != camera.width() || image.height != camera.height())
    require(false, "image", std::to_string(image.width) + " x " + std::to_string(image.height),
            "of the camera's size, " + std::to_string(camera.width()) + " x " +
                std::to_string(camera.height()));
  Job job{image, view, source.cam_from_body.value_or(view.cam_from_body), {}, {}};
  job.frame.time_s = job.seen_s = time_s;
  job.frame.camera = source.camera;
  if (in_order(job)) {
    const std::optional<PosePrediction> predicted = filter_.predict(time_s);
    if (!filter_.started()) {
      begin(job);
    } else if (!predicted) {
      job.frame.reason = "the image is older than the history of the filter: skipped";
    } else if (!(usable(*predicted) && track(job, *predicted)) &&
               (job.dark || !search(job, *predicted))) {
      set_unseen(job, *predicted);
    }
  }
  if (!job.note.empty())
    job.frame.reason = job.note + (job.frame.reason.empty() ? "" : "; " + job.frame.reason);
  job.frame.state = state_;
  fill_pose(job);
  job.frame.timing_s.total_s = seconds_since(begun);
  return std::move(job.frame);
}

std::optional<PosePrediction> TrackerImpl::predict(double time_s) const {
  if (state_ == TrackerState::searching || state_ == TrackerState::lost) return std::nullopt;
  return filter_.predict(time_s);
}

bool TrackerImpl::in_order(Job& job) {
  CameraState& view = job.view;
  const double time_s = job.frame.time_s;
  if (time_s > view.last_s) {
    view.last_s = time_s;
    view.refused = 0;
    return true;
  }
  view.refused = time_s > view.last_refused_s ? view.refused + 1 : 1;
  view.last_refused_s = time_s;
  if (view.refused >= max_late_images) {
    restart_clock(job);
    return true;
  }
  std::ostringstream text;
  text << (time_s == view.last_s ? "a repeated image" : "the clock went back") << ": time "
       << time_s << " s is not after " << view.last_s << " s; skipped";
  job.frame.reason = text.str();
  return false;
}

void TrackerImpl::restart_clock(Job& job) {
  const double by_s = job.view.last_s - job.frame.time_s;
  const std::optional<PosePrediction> last = filter_.predict(job.view.last_s);
  for (CameraState& view : views_)
    view.last_s = view.last_refused_s = -std::numeric_limits<double>::infinity();
  for (CameraState& view : views_) view.looks.clear();
  job.view.last_s = job.frame.time_s;
  job.view.refused = 0;
  std::ostringstream text;
  text << "the clock was set back by " << by_s << " s: restarted at the last pose";
  job.note = text.str();
  integrity_.clear();
  if (!last) return;
  Matrix6 covariance = last->covariance;
  covariance.diagonal().head<3>().array() += square(options_.drift_sigma_rad);
  covariance.diagonal().tail<3>().array() += square(options_.drift_sigma_m);
  filter_.start(job.frame.time_s, last->body_from_world, covariance);
  last_seen_s_ = job.frame.time_s;
}

bool TrackerImpl::usable(const PosePrediction& predicted) const {
  if (predicted.time_s - last_seen_s_ > options_.coast_s) return false;
  const Eigen::Matrix3d position =
      position_covariance(predicted.body_from_world, predicted.covariance);
  return position.trace() < 3 * square(options_.coast_sigma_m);
}

PredictedCamera TrackerImpl::camera_at(const PosePrediction& predicted, const Job& job) const {
  const Matrix6 moves = adjoint(job.cam_from_body);
  return {predicted.time_s - job.frame.time_s, job.cam_from_body * predicted.body_from_world,
          systematic_.camera_covariance(predicted, job.cam_from_body, job.frame.camera),
          moves * predicted.velocity, moves * predicted.velocity_covariance * moves.transpose()};
}

std::vector<Blob> TrackerImpl::detect_at(Job& job,
                                         const std::vector<ExpectedLamp>& expected) const {
  const auto begun = std::chrono::steady_clock::now();
  DetectOptions options = locate::detect_options_of(job.view.scene, detect_);
  options.rims = options.rims || (options_.locate.detect.rims && sizes_next_);
  double pixels = 0;
  const Camera& camera = job.view.scene.camera;
  const std::vector<PixelWindow> windows = windows_of(expected, camera, options_.gate_sigma);
  for (const PixelWindow& w : windows) pixels += double(w.x1 - w.x0 + 1) * double(w.y1 - w.y0 + 1);
  const bool whole = !options_.windows || pixels > 0.5 * camera.width() * camera.height() ||
                     std::isfinite(camera.period_px());
  std::vector<Blob> blobs =
      whole ? detect(job.image, options) : detect_in_windows(job.image, windows, options).blobs;
  job.frame.timing_s.detect_s += seconds_since(begun);
  return blobs;
}

bool TrackerImpl::track(Job& job, const PosePrediction& predicted) {
  const PredictedCamera camera = camera_at(predicted, job);
  const Scene& scene = job.view.scene;
  std::vector<ExpectedLamp> expected =
      expected_lamps(scene, camera, options_.gate_sigma, options_.model_sigma_px);
  if (expected.empty()) return false;
  Found found;
  found.blobs = detect_at(job, expected);
  recall_looks(job, expected);
  adapt_looks(expected, found.blobs, scene, options_.gate_sigma);
  found.matches = match_expected(expected, found.blobs, scene, options_.gate_sigma);
  std::size_t sure = 0;
  for (const ExpectedLamp& lamp : expected) {
    sure += lamp.sure;
    const bool is_there = std::any_of(found.matches.begin(), found.matches.end(),
                                      [&](const Match& m) { return m.lamp == lamp.lamp; });
    if (lamp.sure && !is_there) job.frame.missing.push_back(scene.lamps[lamp.lamp].id);
  }
  if (found.matches.empty()) {
    job.dark = std::all_of(expected.begin(), expected.end(),
                           [](const ExpectedLamp& lamp) { return lamp.dark; });
    if (job.dark) job.frame.reason = "every lamp that should be in view may be dark";
    return false;
  }
  // A few blobs of many lamps may lie in their gates by chance.
  if (2 * found.matches.size() < sure && search(job, predicted)) return true;
  return correct(job, std::move(found));
}

bool TrackerImpl::correct(Job& job, Found found) {
  const auto begun = std::chrono::steady_clock::now();
  const double seen_s =
      job.frame.time_s + mean_delay_s(job.view.scene.sensor, found.matches, found.blobs);
  const PredictedCamera camera = camera_at(*filter_.predict(seen_s), job);
  to_time_of(camera, job.view.scene, found.matches, found.blobs);
  RefineOptions options = options_.locate.refine;
  options.rung = std::min(options.rung, Rung::rims);
  options.prior = Prior{};
  options.prior->last_pose = PriorPose{camera.cam_from_world, camera.covariance};
  const Result<Refined> refined =
      occ::refine(camera.cam_from_world, found.matches, found.blobs, job.view.scene, options);
  job.frame.timing_s.refine_s += seconds_since(begun);
  const bool any = std::any_of(refined->lamps.begin(), refined->lamps.end(),
                               [](const LampResidual& lamp) { return !lamp.contradicts; });
  if (!refined.ok() || !any) {
    if (!job.searched)
      job.frame.reason = refined.ok() ? "no lamp agrees with the prediction" : refined.message;
    return false;
  }
  PoseObservation seen{seen_s, refined->cam_from_world, refined->lamp_information,
                       refined->lamp_gradient, job.cam_from_body};
  if (has_systematic(job)) add_systematic(job, camera, *refined, found, options, seen);
  if (!weigh_branches(job, camera, found, options, *refined, seen)) {
    if (!job.searched) job.frame.reason = "the lamps have the sizes of another pose that fits them";
    return false;
  }
  const FilterUpdate update = filter_.add(seen);
  job.frame.nis = update.nis;
  job.frame.nis_dof = update.nis_dof;
  if (!update.accepted()) {
    if (!job.searched) job.frame.reason = "the lamps contradict the prediction";
    return false;
  }
  job.frame.reason.clear();
  job.seen_s = seen_s;
  if (integrity_.is_on()) protect(job, camera, found, *refined);
  job.frame.lamps.clear();
  for (const LampResidual& lamp : refined->lamps) {
    if (lamp.contradicts) continue;
    job.frame.lamps.emplace(job.view.scene.lamps[lamp.match.lamp].id,
                            std::move(found.blobs[lamp.match.blob]));
  }
  set_tracking(job);
  return true;
}

/// Evaluates the image without the prediction, for the protection level.
void TrackerImpl::protect(Job& job, const PredictedCamera& camera, const Found& found,
                          const Refined& tracked) {
  RefineOptions options = options_.locate.refine;
  options.rung = std::min(options.rung, Rung::rims);
  options.prior = lasting_prior(job);
  if (options.prior->empty()) options.prior.reset();
  const Result<Refined> alone =
      occ::refine(tracked.cam_from_world, found.matches, found.blobs, job.view.scene, options);
  if (!alone.ok()) return;
  const PosePrediction now = *filter_.predict(job.seen_s);
  job.frame.reason = integrity_.add(
      {job.seen_s, *alone, job.cam_from_body, systematic_.own_covariance(camera.velocity)},
      now.body_from_world.origin_in_source().head<2>());
}

double TrackerImpl::protection_level_m(double time_s) const {
  if (!integrity_.is_on()) return infinity;
  // The lines that show the lamps are exposed after the time of the image.
  const double at_s = std::max(time_s, integrity_.since_s());
  const std::optional<PosePrediction> there = predict(at_s);
  if (!there) return infinity;
  return integrity_.level_m(there->body_from_world.origin_in_source().head<2>(), at_s);
}

/// Sets how the lamps looked in the images before, if that is not too long ago.
void TrackerImpl::recall_looks(const Job& job, std::vector<ExpectedLamp>& expected) const {
  const auto& looks = job.view.looks;
  for (ExpectedLamp& lamp : expected) {
    const auto look = looks.find(job.view.scene.lamps[lamp.lamp].id);
    if (look == looks.end()) continue;
    if (job.frame.time_s - look->second.time_s <= options_.coast_s) lamp.before = look->second;
  }
}

void TrackerImpl::set_tracking(const Job& job) {
  for (const auto& [id, blob] : job.frame.lamps)
    if (!blob.cut_by_border) job.view.looks[id] = look_of(blob, job.frame.time_s);
  state_ = TrackerState::tracking;
  last_seen_s_ = std::max(last_seen_s_, job.frame.time_s);
  jumps_.clear();
}

void TrackerImpl::set_unseen(Job& job, const PosePrediction& predicted) {
  state_ = usable(predicted) ? TrackerState::coasting : TrackerState::lost;
  job.frame.lamps.clear();
}

void TrackerImpl::fill_pose(Job& job) const {
  // The lamps of the image update the filter at the time of their lines; from there the pose is
  // moved back to the time of the image.
  std::optional<PosePrediction> now = predict(job.seen_s);
  if (!now) return;
  const double back_s = job.frame.time_s - job.seen_s;
  if (back_s != 0) {
    const Matrix6 moves = adjoint(moved_pose(Rigid3{}, now->velocity, back_s));
    now->body_from_world = moved_pose(now->body_from_world, now->velocity, back_s);
    now->covariance =
        moves * now->covariance * moves.transpose() + square(back_s) * now->velocity_covariance;
  }
  const PredictedCamera camera = camera_at(*now, job);
  TrackedFrame& frame = job.frame;
  frame.cam_from_world = camera.cam_from_world;
  frame.covariance = camera.covariance;
  frame.position_m = camera.cam_from_world.origin_in_source();
  frame.position_covariance_m2 = position_covariance(camera.cam_from_world, camera.covariance);
  if (!integrity_.is_on()) return;
  frame.protection_level_m = protection_level_m(job.seen_s);
  if (frame.protection_level_m <= *options_.alert_limit_m) return;
  std::ostringstream text;
  text << "protection level " << frame.protection_level_m << " m is above the alert limit "
       << *options_.alert_limit_m << " m";
  frame.reason += (frame.reason.empty() ? "" : "; ") + text.str();
}

}  // namespace occ::internal::track
