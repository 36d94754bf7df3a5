// SPDX-License-Identifier: Apache-2.0
#include "libocc/refine/internal/pixel_window.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace occ::internal::refine {
namespace {

/// Margin around the blob's box that shows the background. The threshold has drawn the box slightly
/// outside the rim.
constexpr int margin_px = 4;

/// Reach of the light of another blob around its box.
constexpr int skirt_px = 3;

}  // namespace

WindowReader::WindowReader(const ImageView& image, const Sensor& sensor)
    : image_(image), black_dn_(sensor.black_level_dn), inverse_gain_(1 / sensor.gain_dn_per_e) {
  if (sensor.is_linear()) return;
  const int last = image.type == PixelType::u8 ? 255 : 65535;
  const int highest = std::min(last, static_cast<int>(sensor.full_scale_dn()));
  for (int level = 0; level <= highest; ++level) {
    table_.push_back(static_cast<float>(sensor.linear_dn(level) * inverse_gain_));
  }
  table_.resize(static_cast<std::size_t>(last) + 1, table_.back());
}

template <typename T>
void WindowReader::read_row(const T* row, int channels, BlobWindow& window, float* out) const {
  const T* p = row + static_cast<std::ptrdiff_t>(window.x0) * channels;
  for (int x = 0; x < window.width; ++x, p += channels) {
    out[x] = channels == 1 ? electrons(p[0])
                           : 0.25f * (electrons(p[0]) + 2 * electrons(p[1]) + electrons(p[2]));
  }
}

BlobWindow WindowReader::read(const std::vector<Blob>& blobs, std::size_t index) const {
  const Blob& blob = blobs[index];
  BlobWindow window;
  window.x0 = std::max(0, blob.x0 - margin_px);
  window.y0 = std::max(0, blob.y0 - margin_px);
  window.width = std::min(image_.width - 1, blob.x1 + margin_px) - window.x0 + 1;
  window.height = std::min(image_.height - 1, blob.y1 + margin_px) - window.y0 + 1;
  if (window.width <= 0 || window.height <= 0) return {};
  window.electrons.resize(static_cast<std::size_t>(window.width) *
                          static_cast<std::size_t>(window.height));
  const auto* bytes = static_cast<const unsigned char*>(image_.data);
  for (int y = 0; y < window.height; ++y) {
    const unsigned char* row = bytes + static_cast<std::size_t>(window.y0 + y) * image_.row_bytes;
    float* out = &window.electrons[y * window.width];
    if (image_.type == PixelType::u8) {
      read_row(row, image_.channels, window, out);
    } else {
      read_row(reinterpret_cast<const std::uint16_t*>(row), image_.channels, window, out);
    }
  }
  for (std::size_t i = 0; i < blobs.size(); ++i) {
    if (i == index) continue;
    const Blob& other = blobs[i];
    const bool around =
        other.x0 <= blob.x0 && other.y0 <= blob.y0 && other.x1 >= blob.x1 && other.y1 >= blob.y1;
    if (around) continue;  // a ring of stray light: its box does not bound its pixels
    const int left = std::max(0, other.x0 - skirt_px - window.x0);
    const int right = std::min(window.width - 1, other.x1 + skirt_px - window.x0);
    const int top = std::max(0, other.y0 - skirt_px - window.y0);
    const int bottom = std::min(window.height - 1, other.y1 + skirt_px - window.y0);
    for (int y = top; y <= bottom; ++y)
      for (int x = left; x <= right; ++x)
        window.electrons[y * window.width + x] = std::numeric_limits<float>::quiet_NaN();
  }
  return window;
}

}  // namespace occ::internal::refine
