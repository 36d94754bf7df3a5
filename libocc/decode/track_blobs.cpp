// SPDX-License-Identifier: Apache-2.0
#include "libocc/decode/track_blobs.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <tuple>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

/// Kalman filter of position and velocity.
class Motion {
 public:
  Motion(const Blob& blob, double time_s, const TrackOptions& options)
      : options_(&options), time_s_(time_s) {
    state_ << blob.centroid_px, 0, 0;
    covariance_.setZero();
    covariance_.topLeftCorner<2, 2>() = measured(blob);
    covariance_.bottomRightCorner<2, 2>().diagonal().setConstant(
        std::pow(options.speed_sigma_px_s, 2));
  }

  void predict(double time_s) {
    const double dt = time_s - time_s_, q = std::pow(options_->acceleration_px_s2, 2);
    Eigen::Matrix4d step = Eigen::Matrix4d::Identity();
    step.topRightCorner<2, 2>().diagonal().setConstant(dt);
    state_ = step * state_;
    covariance_ = step * covariance_ * step.transpose();
    for (int i = 0; i < 2; ++i) {
      covariance_(i, i) += q * std::pow(dt, 4) / 4;
      covariance_(i, i + 2) += q * std::pow(dt, 3) / 2;
      covariance_(i + 2, i) += q * std::pow(dt, 3) / 2;
      covariance_(i + 2, i + 2) += q * dt * dt;
    }
    time_s_ = time_s;
  }

  /// Squared Mahalanobis distance of a blob from the prediction.
  double distance2(const Blob& blob) const {
    const Eigen::Vector2d off = blob.centroid_px - state_.head<2>();
    return off.dot(innovation(blob).inverse() * off);
  }

  void update(const Blob& blob) {
    const Eigen::Matrix<double, 4, 2> gain = covariance_.leftCols<2>() * innovation(blob).inverse();
    state_ += gain * (blob.centroid_px - state_.head<2>());
    covariance_ -= gain * covariance_.topRows<2>();
    covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
  }

  Eigen::Vector2d velocity() const { return state_.tail<2>(); }

 private:
  Eigen::Matrix2d measured(const Blob& blob) const {
    return blob.covariance_px2 +
           std::pow(options_->position_sigma_px, 2) * Eigen::Matrix2d::Identity();
  }
  Eigen::Matrix2d innovation(const Blob& blob) const {
    return covariance_.topLeftCorner<2, 2>() + measured(blob);
  }

  const TrackOptions* options_;
  double time_s_;
  Eigen::Vector4d state_;
  Eigen::Matrix4d covariance_;
};

struct OpenTrack {
  Motion motion;
  double last_s;
  std::vector<TrackPoint> points;  // with a blob
};

/// Greedy assignment of blobs to tracks, nearest pairs first; each blob and each track once.
std::vector<std::pair<std::size_t, std::size_t>> assign(const std::vector<OpenTrack>& tracks,
                                                        const FrameBlobs& frame,
                                                        const TrackOptions& options) {
  std::vector<std::tuple<double, std::size_t, std::size_t>> near;
  for (std::size_t t = 0; t < tracks.size(); ++t) {
    if (frame.time_s - tracks[t].last_s > options.max_gap_s) continue;
    for (std::size_t b = 0; b < frame.blobs.size(); ++b) {
      const double distance2 = tracks[t].motion.distance2(frame.blobs[b]);
      if (distance2 < options.gate_sigma * options.gate_sigma) near.emplace_back(distance2, t, b);
    }
  }
  std::sort(near.begin(), near.end());
  std::vector<char> track_taken(tracks.size(), 0), blob_taken(frame.blobs.size(), 0);
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (const auto& [distance2, t, b] : near) {
    if (track_taken[t] || blob_taken[b]) continue;
    track_taken[t] = blob_taken[b] = 1;
    pairs.emplace_back(t, b);
  }
  return pairs;
}

/// Positions in all frames: linear interpolation between blobs, extrapolation with the velocity at
/// both ends.
Track with_all_frames(const OpenTrack& seen, const std::vector<FrameBlobs>& frames) {
  Track track;
  track.seen = static_cast<int>(seen.points.size());
  const auto time = [&](const TrackPoint& p) { return frames[p.frame].time_s; };
  const std::vector<TrackPoint>& points = seen.points;
  const std::size_t nearby = std::min<std::size_t>(points.size() - 1, 5);
  Eigen::Vector2d velocity_before = Eigen::Vector2d::Zero();
  if (nearby > 0)
    velocity_before = (points[nearby].px - points[0].px) / (time(points[nearby]) - time(points[0]));
  std::size_t next = 0;
  for (int f = 0; f < static_cast<int>(frames.size()); ++f) {
    const double now = frames[f].time_s;
    while (next < points.size() && points[next].frame < f) ++next;
    TrackPoint point;
    point.frame = f;
    if (next < points.size() && points[next].frame == f) {
      point = points[next];
    } else if (next == 0) {
      point.px = points.front().px + (now - time(points.front())) * velocity_before;
    } else if (next == points.size()) {
      point.px = points.back().px + (now - time(points.back())) * seen.motion.velocity();
    } else {
      const TrackPoint &a = points[next - 1], &b = points[next];
      point.px = a.px + (now - time(a)) / (time(b) - time(a)) * (b.px - a.px);
    }
    track.points.push_back(point);
  }
  return track;
}

}  // namespace

void TrackOptions::validate() const {
  const auto positive = [](double value, const char* field) {
    require(value > 0 && std::isfinite(value), field, value, "positive");
  };
  positive(gate_sigma, "gate_sigma");
  positive(position_sigma_px, "position_sigma_px");
  positive(speed_sigma_px_s, "speed_sigma_px_s");
  positive(acceleration_px_s2, "acceleration_px_s2");
  positive(max_gap_s, "max_gap_s");
}

void require_in_order(const std::vector<double>& times_s) {
  for (std::size_t i = 0; i < times_s.size(); ++i) {
    const std::string name = "times_s[" + std::to_string(i) + "]";
    require(std::isfinite(times_s[i]), name, times_s[i], "finite");
    if (i > 0 && !(times_s[i] > times_s[i - 1])) {
      std::ostringstream rule;
      rule << "after the frame before it, at " << times_s[i - 1];
      require(false, name, times_s[i], rule.str());
    }
  }
}

std::vector<Track> track_blobs(const std::vector<FrameBlobs>& frames, const TrackOptions& options) {
  options.validate();
  std::vector<double> times_s;
  for (const FrameBlobs& frame : frames) times_s.push_back(frame.time_s);
  require_in_order(times_s);
  std::vector<OpenTrack> open;
  for (std::size_t f = 0; f < frames.size(); ++f) {
    const FrameBlobs& frame = frames[f];
    for (OpenTrack& track : open) track.motion.predict(frame.time_s);
    std::vector<char> assigned(frame.blobs.size(), 0);
    for (const auto& [t, b] : assign(open, frame, options)) {
      const Blob& blob = frame.blobs[b];
      open[t].motion.update(blob);
      open[t].last_s = frame.time_s;
      open[t].points.push_back({static_cast<int>(f), static_cast<int>(b), blob.centroid_px});
      assigned[b] = 1;
    }
    for (std::size_t b = 0; b < frame.blobs.size(); ++b) {
      if (assigned[b]) continue;
      const Blob& blob = frame.blobs[b];
      open.push_back({Motion(blob, frame.time_s, options),
                      frame.time_s,
                      {{static_cast<int>(f), static_cast<int>(b), blob.centroid_px}}});
    }
  }
  std::vector<Track> tracks;
  for (const OpenTrack& track : open) tracks.push_back(with_all_frames(track, frames));
  return tracks;
}

}  // namespace occ
