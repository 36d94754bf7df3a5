// SPDX-License-Identifier: Apache-2.0
// Internal: linear signal of an image. The inverse response is applied to each channel when pixels
// are read, from a table computed once; the image is not copied.
#pragma once

#include <optional>
#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::detect {

class LinearImage {
 public:
  /// `sensor` may be null: its response is then Response::automatic, without a black level.
  LinearImage(const ImageView& view, const Sensor* sensor);

  int width() const { return view_.width; }
  int height() const { return view_.height; }

  /// Writes the linear grey level [DN, black level removed if there is a sensor] of the pixels
  /// [x0, x0 + width) of the rows [y0, y0 + height), row by row.
  void read(int x0, int y0, int width, int height, float* out) const;

  /// Linear signal of a stored grey level.
  double linear_dn(double stored_dn) const;

  /// d linear / d stored at a stored grey level; 1 for a linear response.
  double slope(double stored_dn) const;

  /// Stored value at and above which a channel is clipped.
  double full_scale_dn() const { return full_scale_dn_; }

 private:
  ImageView view_;
  std::optional<Sensor> sensor_;  ///< only if the response is not linear
  double offset_dn_ = 0;          ///< black level of a linear response
  double full_scale_dn_ = 0;
  std::vector<float> table_;  ///< linear value of each 8-bit value if the response is not linear
};

}  // namespace occ::internal::detect
