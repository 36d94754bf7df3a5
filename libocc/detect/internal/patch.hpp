// SPDX-License-Identifier: Apache-2.0
// Internal: the pixels around one component as linear signal above the local background, and how
// noisy they are. Everything sub-pixel is measured on a patch.
#pragma once

#include <vector>

#include "libocc/detect/internal/component.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::detect {

/// Variance of a pixel as a straight line of its signal: read noise and quantisation, shot noise.
struct Noise {
  double floor = 0;    ///< variance [DN^2] of a background pixel
  double per_dn = 0;   ///< variance [DN^2] per DN of signal above background
  bool known = false;  ///< from a sensor; else per_dn is zero until somebody measures it

  double variance(double signal) const { return floor + per_dn * (signal > 0 ? signal : 0); }
};

class Patch {
 public:
  /// Reads the component's bounding box and `margin_px` around it, finds the local background as a
  /// plane through the pixels outside the box, and subtracts it. `limit_dn` (linear): what is above
  /// is not background. The storage is reused from call to call.
  void load(const LinearImage& image, const Component& component, double limit_dn,
            const Sensor* sensor);

  static constexpr int margin_px = 8;

  int x0() const { return x0_; }
  int y0() const { return y0_; }
  int width() const { return width_; }
  int height() const { return height_; }
  bool contains(int x, int y) const {
    return x >= x0_ && y >= y0_ && x < x0_ + width_ && y < y0_ + height_;
  }

  /// Signal of pixel (x, y) of the image; the next pixel of the row follows at +1, the one below at
  /// +width().
  const float* at(int x, int y) const {
    return signal_.data() + static_cast<std::ptrdiff_t>(y - y0_) * width_ + (x - x0_);
  }

  double background_dn() const { return background_dn_; }  ///< linear, at the component's centre
  /// Standard deviation of the background's level there.
  double background_sigma_dn() const { return background_sigma_dn_; }
  const Noise& noise() const { return noise_; }
  /// The signal at which a channel is clipped.
  double full_scale_signal() const { return full_scale_signal_; }

 private:
  void subtract_background(const LinearImage& image, const Component& component, double limit_dn);
  void set_noise(const LinearImage& image, const Component& component, const Sensor* sensor);

  int x0_ = 0, y0_ = 0, width_ = 0, height_ = 0;
  std::vector<float> signal_;
  double background_dn_ = 0, background_sigma_dn_ = 0;
  double ring_variance_ = 0;
  double full_scale_signal_ = 0;
  Noise noise_;
};

}  // namespace occ::internal::detect
