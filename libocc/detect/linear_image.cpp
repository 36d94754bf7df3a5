// SPDX-License-Identifier: Apache-2.0
#include "libocc/detect/internal/linear_image.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/detect/internal/pixels.hpp"

namespace occ::internal::detect {
namespace {

struct PixelBox {
  int x0, y0, width, height;
};

/// Writes the weighted mean of the colour channels, each converted by `to_linear`.
template <typename P, typename F>
void read_box(const P& pixels, const PixelBox& box, F&& to_linear, float* out) {
  for (int y = box.y0; y < box.y0 + box.height; ++y, out += box.width) {
    const typename P::Value* p = pixels.row(y) + static_cast<std::ptrdiff_t>(box.x0) * P::channels;
    for (int i = 0; i < box.width; ++i, p += P::channels) {
      if constexpr (P::channels == 1) {
        out[i] = to_linear(p[0]);
      } else {
        out[i] = 0.25f * (to_linear(p[0]) + 2 * to_linear(p[1]) + to_linear(p[2]));
      }
    }
  }
}

/// The smaller of full scale and the grey level of the full well minus three sigmas of read noise.
double clipped_from_dn(const ImageView& view, const Sensor* sensor) {
  const double highest = view.type == PixelType::u8 ? 255 : 65535;
  if (!sensor) return highest;
  const double full_scale = std::min(highest, sensor->full_scale_dn());
  const double full_well = sensor->grey_level(sensor->full_well_e);
  if (full_well >= full_scale) return full_scale;
  return std::floor(full_well - 3 * sensor->gain_dn_per_e * sensor->read_noise_e);
}

}  // namespace

LinearImage::LinearImage(const ImageView& view, const Sensor* given) : view_(view) {
  Sensor sensor;
  sensor.black_level_dn = 0;
  if (given) sensor = *given;
  sensor = sensor.of_image(view);
  full_scale_dn_ = clipped_from_dn(view, given ? &sensor : nullptr);
  if (sensor.is_linear()) {
    offset_dn_ = sensor.black_level_dn;
    return;
  }
  sensor_ = sensor;
  if (view.type != PixelType::u8) return;
  table_.resize(256);
  for (int i = 0; i < 256; ++i) table_[i] = static_cast<float>(sensor.linear_dn(i));
}

void LinearImage::read(int x0, int y0, int width, int height, float* out) const {
  const PixelBox box{x0, y0, width, height};
  visit_pixels(view_, [&](const auto& pixels) {
    if (!table_.empty()) {
      const auto by_table = [&](int v) { return table_[v]; };
      read_box(pixels, box, by_table, out);
    } else if (sensor_) {
      const auto exactly = [&](int v) { return static_cast<float>(sensor_->linear_dn(v)); };
      read_box(pixels, box, exactly, out);
    } else {
      const float offset = static_cast<float>(offset_dn_);
      read_box(
          pixels, box, [&](int v) { return static_cast<float>(v) - offset; }, out);
    }
  });
}

double LinearImage::linear_dn(double stored_dn) const {
  return sensor_ ? sensor_->linear_dn(stored_dn) : stored_dn - offset_dn_;
}

double LinearImage::slope(double stored_dn) const {
  if (!sensor_) return 1;
  const double low = std::max(0.0, stored_dn - 0.5);
  const double high = std::min(full_scale_dn_, low + 1);
  return (sensor_->linear_dn(high) - sensor_->linear_dn(low)) / (high - low);
}

}  // namespace occ::internal::detect
