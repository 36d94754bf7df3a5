// SPDX-License-Identifier: Apache-2.0
// Sorts odometry and inertial samples by time and cuts them into stretches over which both are
// constant. They may arrive late and in any order; odometry may not overlap.
#pragma once

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/motion_input.hpp"

namespace occ::internal::track {

template <typename Step>
class Timeline {
 public:
  struct Stretch {
    double duration_s = 0;
    const Step* odometry = nullptr;  ///< null where there is none
    double share = 0;                ///< duration over that of the odometry
    const ImuSample* imu = nullptr;  ///< null where there is none
  };

  explicit Timeline(double imu_hold_s) : imu_hold_s_(imu_hold_s) {}

  /// Returns false and drops the step if it overlaps an earlier one.
  bool add(const Step& step) {
    const auto next =
        std::upper_bound(steps_.begin(), steps_.end(), step.from_s,
                         [](double time_s, const Step& other) { return time_s < other.from_s; });
    const bool overlaps = (next != steps_.end() && next->from_s < step.to_s - rounding_s) ||
                          (next != steps_.begin() && (next - 1)->to_s > step.from_s + rounding_s);
    if (!overlaps) steps_.insert(next, step);
    return !overlaps;
  }

  void add(const ImuSample& sample) {
    const auto next = std::upper_bound(
        samples_.begin(), samples_.end(), sample.time_s,
        [](double time_s, const ImuSample& other) { return time_s < other.time_s; });
    samples_.insert(next, sample);
  }

  /// Calls visit(Stretch) for each stretch of [from_s, to_s), in order of time.
  template <typename Visit>
  void walk(double from_s, double to_s, Visit&& visit) const {
    double time_s = from_s;
    while (time_s < to_s) {
      double end_s = to_s;
      Stretch stretch;
      stretch.odometry = odometry_at(time_s, end_s);
      stretch.imu = imu_at(time_s, end_s);
      stretch.duration_s = end_s - time_s;
      if (const Step* step = stretch.odometry)
        stretch.share = stretch.duration_s / (step->to_s - step->from_s);
      visit(stretch);
      time_s = end_s;
    }
  }

  void drop_before(double time_s) {
    while (!steps_.empty() && steps_.front().to_s <= time_s) steps_.pop_front();
    // The last sample before that time still holds after it.
    while (samples_.size() > 1 && samples_[1].time_s <= time_s) samples_.pop_front();
  }

 private:
  static constexpr double rounding_s = 1e-9;

  /// Returns the step that covers a time, or null; lowers `end_s` to where that changes.
  const Step* odometry_at(double time_s, double& end_s) const {
    const auto next =
        std::upper_bound(steps_.begin(), steps_.end(), time_s,
                         [](double time, const Step& other) { return time < other.from_s; });
    if (next != steps_.end()) end_s = std::min(end_s, next->from_s);
    if (next == steps_.begin() || (next - 1)->to_s <= time_s) return nullptr;
    end_s = std::min(end_s, (next - 1)->to_s);
    return &*(next - 1);
  }

  const ImuSample* imu_at(double time_s, double& end_s) const {
    const auto next =
        std::upper_bound(samples_.begin(), samples_.end(), time_s,
                         [](double time, const ImuSample& other) { return time < other.time_s; });
    if (next != samples_.end()) end_s = std::min(end_s, next->time_s);
    if (next == samples_.begin()) return nullptr;
    const double held_until_s = (next - 1)->time_s + imu_hold_s_;
    if (held_until_s <= time_s) return nullptr;
    end_s = std::min(end_s, held_until_s);
    return &*(next - 1);
  }

  double imu_hold_s_;
  std::deque<Step> steps_;
  std::deque<ImuSample> samples_;
};

}  // namespace occ::internal::track
