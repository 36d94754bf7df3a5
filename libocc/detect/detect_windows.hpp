// SPDX-License-Identifier: Apache-2.0
// Detection in parts of an image only: where a tracker expects lamps.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/detect/detect.hpp"

namespace occ {

/// Pixels x0 <= x <= x1, y0 <= y <= y1; may reach beyond the image.
struct PixelWindow {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;
};

struct WindowBlobs {
  std::vector<Blob> blobs;  ///< brightest first, in the image's pixels
  int cut = 0;  ///< left out as the border of a window, which is not the image's, cuts them
};

/// As detect() finds them, from windows at least twice as wide as the lamps they hold: background
/// and noise are those of each window. Windows that overlap become one. Throws as detect() does,
/// and std::invalid_argument for a window that ends before it begins.
LIBOCC_API WindowBlobs detect_in_windows(const ImageView& image,
                                         const std::vector<PixelWindow>& windows,
                                         const DetectOptions& options = {});

}  // namespace occ
