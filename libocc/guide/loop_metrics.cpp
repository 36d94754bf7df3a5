// SPDX-License-Identifier: Apache-2.0
#include "libocc/guide/internal/loop_metrics.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "libocc/core/internal/dense.hpp"
#include "libocc/core/statistics.hpp"

namespace occ::internal::guide {
namespace {

/// Accumulates mean, root mean square and maximum of magnitudes.
struct Spread {
  double sum = 0, squares = 0, max = 0;
  int count = 0;

  void add(double value) {
    sum += std::abs(value);
    squares += value * value;
    max = std::max(max, std::abs(value));
    ++count;
  }
  double mean() const { return count ? sum / count : 0; }
  double rms() const { return count ? std::sqrt(squares / count) : 0; }
};

void add_route(const LoopResult& result, LoopMetrics& metrics) {
  Spread cross_track;
  const PlanarPose* before = nullptr;
  for (const LoopRecord& record : result.records) {
    if (!record.docking && (record.estimate.has_pose() || record.along_m > 0))
      cross_track.add(record.deviation_m);
    if (before) metrics.driven_m += (record.truth.position() - before->position()).norm();
    before = &record.truth;
    metrics.limited_steps += record.limited.speed || record.limited.turn ? 1 : 0;
  }
  metrics.cross_track_mean_m = cross_track.mean();
  metrics.cross_track_rmse_m = cross_track.rms();
  metrics.cross_track_max_m = cross_track.max;
}

void add_estimates(const LoopResult& result, double dt_s, LoopMetrics& metrics) {
  Spread position, heading;
  double nees = 0, variance_m2 = 0;
  int counted = 0;
  std::vector<double> levels_m;
  bool seen = false;  // before the first image the estimate is the given start pose
  for (const LoopRecord& record : result.records) {
    seen = seen || record.frames > 0;
    metrics.alert_s += record.alert ? dt_s : 0;
    if (!record.estimate.has_pose()) {
      metrics.lost_s += dt_s;
      continue;
    }
    if (!seen) continue;
    const Eigen::Vector3d error = difference(record.estimate.pose, record.truth);
    position.add(error.head<2>().norm());
    const double level_m = record.estimate.protection_level_m;
    if (std::isfinite(level_m)) levels_m.push_back(level_m);
    metrics.misleading_s += error.head<2>().norm() > level_m ? dt_s : 0;
    heading.add(error.z());
    const core::Cholesky<Eigen::Matrix3d> cholesky(record.estimate.covariance);
    if (!cholesky.exists()) continue;
    nees += error.dot(cholesky.solve(error));
    variance_m2 += record.estimate.covariance.topLeftCorner<2, 2>().trace();
    ++counted;
  }
  if (!levels_m.empty()) metrics.protection_level_m = median(levels_m);
  metrics.position_rmse_m = position.rms();
  metrics.position_max_m = position.max;
  metrics.heading_rmse_rad = heading.rms();
  metrics.heading_max_rad = heading.max;
  metrics.nees = counted ? nees / counted : 0;
  metrics.position_sigma_m = counted ? std::sqrt(variance_m2 / counted) : 0;
}

/// Evaluates images in the order of capture; repeated ones count once.
void add_availability(const LoopResult& result, double period_s, LoopMetrics& metrics) {
  int tracked = 0, three = 0;
  double last_s = 0, outage_s = 0, captured_s = -1;
  for (const LoopFrame& frame : result.frames) {
    if (frame.captured_s == captured_s) continue;
    captured_s = frame.captured_s;
    ++metrics.frames;
    if (frame.lost || frame.state != TrackerState::tracking) continue;
    ++tracked;
    three += frame.lamps_used >= 3 ? 1 : 0;
    outage_s = std::max(outage_s, captured_s - last_s - period_s);
    last_s = captured_s;
  }
  if (metrics.frames == 0) return;
  metrics.availability = tracked / static_cast<double>(metrics.frames);
  metrics.three_lamps = three / static_cast<double>(metrics.frames);
  outage_s = std::max(outage_s, captured_s - last_s);
  metrics.longest_outage_s = outage_s > 1e-6 * period_s ? outage_s : 0;
}

void add_images(const LoopResult& result, LoopMetrics& metrics) {
  std::vector<double> taken;
  double nis = 0;
  int dof = 0;
  for (const LoopFrame& frame : result.frames) {
    if (frame.lost) continue;
    taken.push_back(frame.taken_s);
    metrics.relocations += frame.relocated ? 1 : 0;
    metrics.clock_jumps += frame.clock_jumped_s != 0 ? 1 : 0;
    nis += frame.nis;
    dof += frame.nis_dof;
  }
  metrics.nis_per_dof = dof ? nis / dof : 0;
  if (taken.empty()) return;
  for (const double s : taken) metrics.frame_mean_s += s / static_cast<double>(taken.size());
  metrics.frame_median_s = median(taken);
  const auto p99 = taken.begin() + static_cast<std::ptrdiff_t>(99 * (taken.size() - 1) / 100);
  std::nth_element(taken.begin(), p99, taken.end());
  metrics.frame_p99_s = *p99;
}

}  // namespace

LoopMetrics summarise(const LoopResult& result, const Route& route, const LoopOptions& options) {
  LoopMetrics metrics;
  if (result.records.empty()) return metrics;
  const LoopRecord& last = result.records.back();
  metrics.duration_s = last.time_s;
  add_route(result, metrics);
  add_estimates(result, 1 / options.control_rate_hz, metrics);
  add_availability(result, 1 / options.frame_rate_hz, metrics);
  add_images(result, metrics);
  const PlanarPose goal = route.dock().value_or(route.at(route.length_m()).pose);
  metrics.final_error = goal.inverse() * last.truth;
  metrics.final_position_error_m = metrics.final_error.position().norm();
  metrics.final_heading_error_rad = std::abs(metrics.final_error.heading_rad);
  return metrics;
}

}  // namespace occ::internal::guide
