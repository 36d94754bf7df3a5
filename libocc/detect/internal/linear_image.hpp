// SPDX-License-Identifier: Apache-2.0
// Internal: grey levels of an image as linear signal, converted where they are read: the response
// is undone channel by channel with a table made once, and nothing is copied beforehand.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::detect {

class LinearImage {
 public:
  /// `sensor` may be null: levels are then taken as linear, as they are stored.
  LinearImage(const ImageView& view, const Sensor* sensor);

  int width() const { return view_.width; }
  int height() const { return view_.height; }

  /// Writes the linear grey level [DN, black level removed when there is a sensor] of pixels
  /// [x0, x0 + width) of rows [y0, y0 + height), row after row.
  void read(int x0, int y0, int width, int height, float* out) const;

  /// Linear signal of a stored grey level.
  double linear_dn(double stored_dn) const;

  /// d linear / d stored at a stored grey level; 1 for a linear response.
  double slope(double stored_dn) const;

  /// Stored value from which on a channel is clipped.
  double full_scale_dn() const { return full_scale_dn_; }

 private:
  ImageView view_;
  std::optional<Sensor> sensor_;  ///< only with a response to undo
  double offset_dn_ = 0;          ///< black level of a linear response
  double full_scale_dn_ = 0;
  std::vector<float> table_;  ///< of every 8-bit value, when the response is not linear
};

}  // namespace occ::internal::detect
