// SPDX-License-Identifier: Apache-2.0
// Internal: images whose clock has jumped. When images take much longer or shorter to arrive than
// they did, their clock is to blame, not the way: their time is that of their arrival less what the
// way took before.
#pragma once

#include <cmath>
#include <optional>

namespace occ::internal::guide {

class ClockGuard {
 public:
  explicit ClockGuard(double max_change_s) : max_change_s_(max_change_s) {}

  /// When an image was captured, by this clock.
  double captured_s(double stamped_s, double now_s) {
    const double way_s = now_s - stamped_s - offset_s_;
    if (way_s_ && !(std::abs(way_s - *way_s_) <= max_change_s_)) {
      jumped_s_ = *way_s_ - way_s;
      offset_s_ -= jumped_s_;
    } else {
      jumped_s_ = 0;
      constexpr double learning = 0.1;
      way_s_ = way_s_ ? *way_s_ + learning * (way_s - *way_s_) : way_s;
    }
    return stamped_s + offset_s_;
  }

  /// By how much the clock was set forward before the last image; 0 as a rule.
  double jumped_s() const { return jumped_s_; }

 private:
  double max_change_s_;
  double offset_s_ = 0, jumped_s_ = 0;
  std::optional<double> way_s_;
};

}  // namespace occ::internal::guide
