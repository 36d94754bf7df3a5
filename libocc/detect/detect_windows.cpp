// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/detect_windows.hpp"

#include <algorithm>
#include <string>

#include "libocc/core/require.hpp"

namespace occ {
namespace {

bool overlap(const PixelWindow& a, const PixelWindow& b) {
  return a.x0 <= b.x1 && b.x0 <= a.x1 && a.y0 <= b.y1 && b.y0 <= a.y1;
}

PixelWindow around(const PixelWindow& a, const PixelWindow& b) {
  return {std::min(a.x0, b.x0), std::min(a.y0, b.y0), std::max(a.x1, b.x1), std::max(a.y1, b.y1)};
}

/// Window clipped to the image. It starts at even pixels to keep the phase of a colour mosaic.
PixelWindow clipped(const PixelWindow& window, const ImageView& image) {
  return {std::max(window.x0, 0) & ~1, std::max(window.y0, 0) & ~1,
          std::min(window.x1, image.width - 1), std::min(window.y1, image.height - 1)};
}

std::vector<PixelWindow> disjoint(const std::vector<PixelWindow>& windows, const ImageView& image) {
  std::vector<PixelWindow> out;
  for (const PixelWindow& given : windows) {
    require(given.x1 >= given.x0 && given.y1 >= given.y0, "windows", given.x1 - given.x0,
            "windows that end after they begin");
    PixelWindow window = clipped(given, image);
    if (window.x1 < window.x0 || window.y1 < window.y0) continue;
    // A merged window may overlap others.
    for (bool grown = true; grown;) {
      grown = false;
      for (std::size_t i = 0; i < out.size(); ++i) {
        if (!overlap(out[i], window)) continue;
        window = around(out[i], window);
        out.erase(out.begin() + static_cast<std::ptrdiff_t>(i));
        grown = true;
        break;
      }
    }
    out.push_back(window);
  }
  return out;
}

ImageView part_of(const ImageView& image, const PixelWindow& window) {
  ImageView part = image;
  const std::size_t bytes =
      static_cast<std::size_t>(image.channels) * (image.type == PixelType::u16 ? 2 : 1);
  part.data = static_cast<const unsigned char*>(image.data) +
              static_cast<std::size_t>(window.y0) * image.row_bytes +
              static_cast<std::size_t>(window.x0) * bytes;
  part.width = window.x1 - window.x0 + 1;
  part.height = window.y1 - window.y0 + 1;
  return part;
}

void shift(const PixelWindow& window, Blob& blob) {
  const Eigen::Vector2d by(window.x0, window.y0);
  blob.centroid_px += by;
  blob.ellipse.centre_px += by;
  for (RimPoint& point : blob.rim) point.px += by;
  blob.x0 += window.x0;
  blob.x1 += window.x0;
  blob.y0 += window.y0;
  blob.y1 += window.y0;
}

/// True if the window's border cuts the blob and the image continues beyond it.
bool is_cut_by(const PixelWindow& window, const Blob& blob, const ImageView& image) {
  return (blob.x0 <= window.x0 && window.x0 > 0) || (blob.y0 <= window.y0 && window.y0 > 0) ||
         (blob.x1 >= window.x1 && window.x1 < image.width - 1) ||
         (blob.y1 >= window.y1 && window.y1 < image.height - 1);
}

}  // namespace

WindowBlobs detect_in_windows(const ImageView& image, const std::vector<PixelWindow>& windows,
                              const DetectOptions& options) {
  image.validate();
  WindowBlobs found;
  for (const PixelWindow& window : disjoint(windows, image)) {
    for (Blob& blob : detect(part_of(image, window), options)) {
      shift(window, blob);
      if (is_cut_by(window, blob, image)) {
        ++found.cut;
      } else {
        found.blobs.push_back(std::move(blob));
      }
    }
  }
  std::stable_sort(found.blobs.begin(), found.blobs.end(),
                   [](const Blob& a, const Blob& b) { return a.flux_dn > b.flux_dn; });
  return found;
}

}  // namespace occ
