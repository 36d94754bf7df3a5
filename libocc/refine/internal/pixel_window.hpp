// SPDX-License-Identifier: Apache-2.0
// Pixels around one blob, converted to electrons.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/radiometry/sensor.hpp"

namespace occ::internal::refine {

struct BlobWindow {
  int x0 = 0, y0 = 0, width = 0, height = 0;
  std::vector<float> electrons;  ///< row by row; NaN near another blob
  bool empty() const { return electrons.empty(); }
};

/// Reads windows of one image and inverts the sensor response as detection does.
class LIBOCC_API WindowReader {
 public:
  /// Keeps a reference to the sensor.
  WindowReader(const ImageView& image, const Sensor& sensor);

  /// Box of blobs[index] and a few pixels around it. The choice of pixels depends on the detection
  /// only, so that the chi-square of different poses can be compared.
  BlobWindow read(const std::vector<Blob>& blobs, std::size_t index) const;

 private:
  template <typename T>
  void read_row(const T* row, int channels, BlobWindow& window, float* out) const;
  float electrons(int stored) const {
    return table_.empty() ? static_cast<float>((stored - black_dn_) * inverse_gain_)
                          : table_[stored];
  }

  ImageView image_;
  double black_dn_, inverse_gain_;
  std::vector<float> table_;  // of every stored value, for a nonlinear response
};

}  // namespace occ::internal::refine
