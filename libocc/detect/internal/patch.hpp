// SPDX-License-Identifier: Apache-2.0
// Internal: the pixels around one component as linear signal above the local background, with their
// noise. All sub-pixel measurements use a patch.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <vector>

#include "libocc/detect/internal/components.hpp"
#include "libocc/detect/internal/linear_image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::detect {

/// Variance of a pixel as a linear function of its signal: constant (read noise, quantisation) plus
/// proportional (shot noise).
struct Noise {
  double floor = 0;    ///< variance [DN^2] of a background pixel
  double per_dn = 0;   ///< variance [DN^2] per DN of signal above background
  bool known = false;  ///< true: from a sensor; false: per_dn is zero until it is estimated

  double variance(double signal) const { return floor + per_dn * (signal > 0 ? signal : 0); }
};

class Patch {
 public:
  /// Reads the component's bounding box with a margin of `margin_px`, fits the local background as
  /// a plane to the pixels outside the box, and subtracts it. Pixels above `limit_dn` (linear) are
  /// not background. The storage is reused from call to call.
  void load(const LinearImage& image, const Component& component, double limit_dn,
            const Sensor* sensor);

  static constexpr int margin_px = 8;  // enough background pixels around small spots

  int x0() const { return x0_; }
  int y0() const { return y0_; }
  int width() const { return width_; }
  int height() const { return height_; }
  bool contains(int x, int y) const {
    return x >= x0_ && y >= y0_ && x < x0_ + width_ && y < y0_ + height_;
  }

  /// Pointer to the signal of image pixel (x, y); the next pixel of the row is at +1, the one below
  /// at +width().
  const float* at(int x, int y) const {
    return signal_.data() + static_cast<std::ptrdiff_t>(y - y0_) * width_ + (x - x0_);
  }

  /// Signal between pixels, bilinear; empty outside the patch.
  std::optional<double> interpolated(const Eigen::Vector2d& px) const {
    const int x = static_cast<int>(std::floor(px.x())), y = static_cast<int>(std::floor(px.y()));
    if (!contains(x, y) || !contains(x + 1, y + 1)) return std::nullopt;
    const double u = px.x() - x, v = px.y() - y;
    const float *upper = at(x, y), *lower = at(x, y + 1);
    return (1 - v) * ((1 - u) * upper[0] + u * upper[1]) + v * ((1 - u) * lower[0] + u * lower[1]);
  }

  double background_dn() const { return background_dn_; }  ///< linear, at the component's centre
  /// Standard deviation of background_dn().
  double background_sigma_dn() const { return background_sigma_dn_; }
  const Noise& noise() const { return noise_; }
  /// Signal at which a channel is clipped.
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
