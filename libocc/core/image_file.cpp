// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/image_file.hpp"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <limits>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "libocc/core/internal/file.hpp"
#include "libocc/core/internal/whole_file.hpp"

namespace occ {

using namespace internal::core;

namespace {

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw std::runtime_error(path + ": " + reason);
}

cv::Mat decode(const std::string& path, std::string bytes) {
  if (bytes.empty()) fail(path, "is empty, not an image");
  if (bytes.size() > std::numeric_limits<int>::max()) fail(path, "is larger than 2 GiB");
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8U, bytes.data());
    return cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& error) {
    fail(path, "cannot be decoded: " + error.err);
  }
}

template <typename T>
void copy_pixels(const cv::Mat& pixels, std::vector<T>& out) {
  const auto row =
      static_cast<std::size_t>(pixels.cols) * static_cast<std::size_t>(pixels.channels());
  out.resize(row * static_cast<std::size_t>(pixels.rows));
  for (int y = 0; y < pixels.rows; ++y) {
    std::memcpy(out.data() + static_cast<std::size_t>(y) * row, pixels.ptr(y), row * sizeof(T));
  }
}

/// Lower-case extension with its dot; empty when the name has none.
std::string extension(const std::string& path) {
  const std::size_t dot = path.find_last_of("./");
  if (dot == std::string::npos || path[dot] == '/') return "";
  std::string text = path.substr(dot);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// OpenCV would silently clip deeper pixels to 8 bits for the other formats.
bool holds_16_bits(const std::string& extension) {
  static const char* const formats[] = {".png", ".tif", ".tiff", ".pgm", ".ppm", ".pnm", ".jp2"};
  return std::find(std::begin(formats), std::end(formats), extension) != std::end(formats);
}

}  // namespace

Image read_image(const std::string& path) {
  std::string bytes = read_file(path);
  if (const char* reason = missing_end(bytes)) fail(path, reason);
  const cv::Mat pixels = decode(path, std::move(bytes));
  if (pixels.empty()) fail(path, "is not an image that can be read");
  if (pixels.depth() != CV_8U && pixels.depth() != CV_16U) {
    fail(path, "pixels must be 8- or 16-bit unsigned, got OpenCV type " +
                   cv::typeToString(pixels.type()));
  }
  if (pixels.channels() == 2) fail(path, "has 2 channels; 1, 3 or 4 are read");
  Image image;
  image.width = pixels.cols;
  image.height = pixels.rows;
  image.channels = pixels.channels();
  image.type = pixels.depth() == CV_8U ? PixelType::u8 : PixelType::u16;
  if (image.type == PixelType::u8) {
    copy_pixels(pixels, image.u8);
  } else {
    copy_pixels(pixels, image.u16);
  }
  return image;
}

std::vector<unsigned char> encode_image(const std::string& extension, const ImageView& image) {
  image.validate();
  if (image.type == PixelType::u16 && !holds_16_bits(extension))
    throw std::runtime_error("16-bit pixels need .png, .tiff or .pgm, got \"" + extension + '"');
  const int depth = image.type == PixelType::u8 ? CV_8U : CV_16U;
  const cv::Mat pixels(image.height, image.width, CV_MAKETYPE(depth, image.channels),
                       const_cast<void*>(image.data), image.row_bytes);  // only read from
  const std::string refusal = "cannot be encoded as \"" + extension + '"';
  std::vector<unsigned char> bytes;
  try {
    if (!cv::imencode(extension, pixels, bytes)) throw std::runtime_error(refusal);
  } catch (const cv::Exception& error) {
    throw std::runtime_error(refusal + ": " + error.err);
  }
  return bytes;
}

void write_image(const std::string& path, const ImageView& image) {
  const std::vector<unsigned char> bytes = [&] {
    try {
      return encode_image(extension(path), image);
    } catch (const std::runtime_error& error) {
      fail(path, error.what());
    }
  }();
  write_file(path, bytes.data(), bytes.size());
}

}  // namespace occ
