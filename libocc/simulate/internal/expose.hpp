// SPDX-License-Identifier: Apache-2.0
// The sensor: from mean signal electrons of every pixel to the image. Tables are made when they are
// first needed and kept from image to image.
#pragma once

#include <optional>

#include "libocc/simulate/internal/sensor_rows.hpp"

namespace occ::internal::simulate {

class Exposure {
 public:
  explicit Exposure(Simd simd) : simd_(simd) {}

  /// Writes the image into `out`, and what it says of its pixels. Of an image that an earlier call
  /// left there, only the pixels that may change are written.
  void expose(const Signal& signal, const Frame& frame, Rendered& out);

 private:
  Simd simd_;
  std::optional<SensorRows> rows_;
};

}  // namespace occ::internal::simulate
