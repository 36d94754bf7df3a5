// SPDX-License-Identifier: Apache-2.0
// Detects and corrects jumps of the clock that stamps the images. A sudden change of the transport
// delay is attributed to the clock. The capture time is then the arrival time minus the previous
// delay.
#pragma once

#include <cmath>
#include <optional>

namespace occ::internal::guide {

class ClockGuard {
 public:
  explicit ClockGuard(double max_change_s) : max_change_s_(max_change_s) {}

  /// Returns the corrected capture time of an image.
  double captured_s(double stamped_s, double now_s) {
    const double delay_s = now_s - stamped_s - offset_s_;
    if (delay_s_ && !(std::abs(delay_s - *delay_s_) <= max_change_s_)) {
      jumped_s_ = *delay_s_ - delay_s;
      offset_s_ -= jumped_s_;
    } else {
      jumped_s_ = 0;
      constexpr double smoothing = 0.1;
      delay_s_ = delay_s_ ? *delay_s_ + smoothing * (delay_s - *delay_s_) : delay_s;
    }
    return stamped_s + offset_s_;
  }

  /// Jump of the clock before the last image; 0 if there was none.
  double jumped_s() const { return jumped_s_; }

 private:
  double max_change_s_;
  double offset_s_ = 0, jumped_s_ = 0;
  std::optional<double> delay_s_;
};

}  // namespace occ::internal::guide
