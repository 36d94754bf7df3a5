// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/image.hpp"

#include <cstring>

#include "libocc/core/require.hpp"

namespace occ {

namespace {

std::size_t bytes_per_row(int width, int channels, PixelType type) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(channels) *
         (type == PixelType::u8 ? 1u : 2u);
}

template <typename T>
void grey_row(const T* row, int channels, int width, T* out) {
  if (channels == 1) {
    std::memcpy(out, row, static_cast<std::size_t>(width) * sizeof(T));
    return;
  }
  for (int x = 0; x < width; ++x, row += channels) {
    out[x] = static_cast<T>((row[0] + 2u * row[1] + row[2] + 2u) / 4u);
  }
}

template <typename T>
void grey_pixels(const ImageView& image, std::vector<T>& out) {
  const auto width = static_cast<std::size_t>(image.width);
  out.resize(width * static_cast<std::size_t>(image.height));
  const auto* bytes = static_cast<const unsigned char*>(image.data);
  for (std::size_t y = 0; y < static_cast<std::size_t>(image.height); ++y) {
    const void* row = bytes + y * image.row_bytes;
    grey_row(static_cast<const T*>(row), image.channels, image.width, out.data() + y * width);
  }
}

}  // namespace

void ImageView::validate(const std::string& name) const {
  require(width > 0, name + ".width", width, "positive");
  require(height > 0, name + ".height", height, "positive");
  require(channels == 1 || channels == 3 || channels == 4, name + ".channels", channels,
          "1, 3 or 4");
  require(data != nullptr, name + ".data", "null", "a pointer to pixels");
  const std::size_t row = bytes_per_row(width, channels, type);
  require(row_bytes >= row, name + ".row_bytes", row_bytes, "at least " + std::to_string(row));
  if (type == PixelType::u16) {
    const bool even = row_bytes % 2 == 0 && reinterpret_cast<std::uintptr_t>(data) % 2 == 0;
    require(even, name + ".data and row_bytes", row_bytes, "even for 16-bit pixels");
  }
}

ImageView Image::view() const {
  const std::size_t row = bytes_per_row(width, channels, type);
  const std::size_t held = type == PixelType::u8 ? u8.size() : u16.size() * 2;
  require(held == row * static_cast<std::size_t>(height), "image's pixel bytes", held,
          "width * height * channels * bytes per channel");
  const void* data = type == PixelType::u8 ? static_cast<const void*>(u8.data())
                                           : static_cast<const void*>(u16.data());
  return {data, width, height, channels, type, row};
}

Image to_grey(const ImageView& image) {
  image.validate();
  Image grey;
  grey.width = image.width;
  grey.height = image.height;
  grey.type = image.type;
  if (image.type == PixelType::u8) {
    grey_pixels(image, grey.u8);
  } else {
    grey_pixels(image, grey.u16);
  }
  return grey;
}

}  // namespace occ
