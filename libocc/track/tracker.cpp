// SPDX-License-Identifier: Apache-2.0
#include "libocc/track/tracker.hpp"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "libocc/core/require.hpp"
#include "libocc/track/internal/tracker_impl.hpp"

namespace occ {

using namespace internal::track;

const char* to_string(TrackerState state) {
  switch (state) {
    case TrackerState::searching:
      return "searching";
    case TrackerState::tracking:
      return "tracking";
    case TrackerState::coasting:
      return "coasting";
    case TrackerState::lost:
      return "lost";
  }
  return "unknown";
}

void TrackerOptions::validate() const {
  locate.validate();
  filter.validate();
  if (floor) floor->validate();
  const auto positive = [](double value, const char* name) {
    require(value > 0 && std::isfinite(value), name, value, "positive");
  };
  positive(gate_sigma, "gate_sigma");
  require(model_sigma_px >= 0 && std::isfinite(model_sigma_px), "model_sigma_px", model_sigma_px,
          "zero or positive");
  const auto not_negative = [](double value, const char* name) {
    require(value >= 0 && std::isfinite(value), name, value, "zero or positive");
  };
  not_negative(mount_sigma_rad, "mount_sigma_rad");
  not_negative(mount_sigma_m, "mount_sigma_m");
  not_negative(clock_sigma_s, "clock_sigma_s");
  positive(coast_s, "coast_s");
  positive(coast_sigma_m, "coast_sigma_m");
  positive(drift_sigma_m, "drift_sigma_m");
  positive(drift_sigma_rad, "drift_sigma_rad");
  require(confirmations >= 1, "confirmations", confirmations, "at least 1");
  if (alert_limit_m) positive(*alert_limit_m, "alert_limit_m");
  require(integrity_risk > 0 && integrity_risk < 1, "integrity_risk", integrity_risk,
          "between 0 and 1");
}

Tracker::Tracker(const Scene& scene, const TrackerOptions& options, const Rigid3& cam_from_body)
    : impl_(std::make_unique<TrackerImpl>(scene, options, cam_from_body)) {}

Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
Tracker::~Tracker() = default;

int Tracker::add_camera(const Scene& scene, const Rigid3& cam_from_body) {
  return impl_->add_camera(scene, cam_from_body);
}

void Tracker::start(double time_s, const Rigid3& body_from_world, const Matrix6& covariance) {
  impl_->start(time_s, body_from_world, covariance);
}

TrackedFrame Tracker::add_image(const ImageView& image, double time_s, const FrameSource& source) {
  return impl_->add_image(image, time_s, source);
}

FilterUpdate Tracker::add(const Odometry& step) {
  PoseFilter* filter = impl_->filter().in_space();
  if (!filter)
    throw std::logic_error("the tracker's body is on a floor: add PlanarOdometry instead");
  return filter->add(step);
}

FilterUpdate Tracker::add(const PlanarOdometry& step) {
  PlanarFilter* filter = impl_->filter().on_floor();
  if (!filter) throw std::logic_error("the tracker's body moves in space: add Odometry instead");
  impl_->integrity().add(step);
  return filter->add(step);
}

FilterUpdate Tracker::add(const ImuSample& sample) {
  impl_->integrity().add(sample);
  return impl_->filter().add(sample);
}

TrackerState Tracker::state() const { return impl_->state(); }

std::optional<PosePrediction> Tracker::predict(double time_s) const {
  return impl_->predict(time_s);
}

std::optional<PlanarEstimate> Tracker::planar(double time_s) const {
  const PlanarFilter* filter = impl_->filter().on_floor();
  if (!filter || !impl_->predict(time_s)) return std::nullopt;
  return filter->at(time_s);
}

double Tracker::protection_level_m(double time_s) const {
  return impl_->protection_level_m(time_s);
}

}  // namespace occ
