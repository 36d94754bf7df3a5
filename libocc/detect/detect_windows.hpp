// SPDX-License-Identifier: Apache-2.0
// Detection in parts of an image only, for example where a tracker predicts the lamps.
#pragma once

#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/image.hpp"
#include "libocc/detect/detect.hpp"

namespace occ {

/// Pixels x0 <= x <= x1, y0 <= y <= y1; may extend beyond the image.
struct PixelWindow {
  int x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< first and last column and row, both included
};

/// Result of detect_in_windows().
struct WindowBlobs {
  std::vector<Blob> blobs;  ///< sorted by decreasing flux, in pixels of the whole image
  int cut = 0;              ///< number of blobs discarded because the border of a window cuts them
};

/// Runs detect() on each window. Background and noise are estimated per window, so a window should
/// be at least twice as wide as the lamps in it. Overlapping windows are merged. Throws like
/// detect(), and std::invalid_argument for a window with x1 < x0 or y1 < y0.
LIBOCC_API WindowBlobs detect_in_windows(const ImageView& image,
                                         const std::vector<PixelWindow>& windows,
                                         const DetectOptions& options = {});

}  // namespace occ
