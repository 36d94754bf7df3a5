// SPDX-License-Identifier: Apache-2.0
// PGM and PPM files (Netpbm's P2, P3, P5 and P6), https://netpbm.sourceforge.net/doc/pgm.html.
#include <algorithm>
#include <cstring>

#include "libocc/core/internal/image_codecs.hpp"

namespace occ::internal::core {

namespace {

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Reads decimal numbers between white space and comments ('#' up to the end of the line).
class NumberReader {
 public:
  explicit NumberReader(std::string_view bytes) : bytes_(bytes) {}

  std::uint32_t next(const char* what) {
    skip_space();
    if (at_ == bytes_.size()) throw std::runtime_error(std::string("is truncated: no ") + what);
    const std::size_t first = at_;
    std::uint32_t value = 0;
    for (; at_ < bytes_.size() && is_digit(bytes_[at_]); ++at_) {
      if (at_ - first == 9) throw std::runtime_error(std::string(what) + " is too large");
      value = 10 * value + static_cast<std::uint32_t>(bytes_[at_] - '0');
    }
    if (at_ == first) {
      throw std::runtime_error("byte " + std::to_string(at_) + ": " + what +
                               " must be a decimal number");
    }
    return value;
  }

  /// All bytes after the one white space that ends the header.
  std::string_view rest() const {
    if (at_ == bytes_.size()) throw std::runtime_error("is truncated: no pixels");
    if (!is_space(bytes_[at_])) {
      throw std::runtime_error("byte " + std::to_string(at_) +
                               ": white space must follow the header");
    }
    return bytes_.substr(at_ + 1);
  }

 private:
  void skip_space() {
    for (; at_ < bytes_.size(); ++at_) {
      if (bytes_[at_] == '#') {
        at_ = std::min(bytes_.find('\n', at_), bytes_.size() - 1);
      } else if (!is_space(bytes_[at_])) {
        return;
      }
    }
  }

  std::string_view bytes_;
  std::size_t at_ = 2;  // after the letter P and the kind
};

int channels_of_kind(char kind) {
  switch (kind) {
    case '2':
    case '5':
      return 1;
    case '3':
    case '6':
      return 3;
    case 'f':
    case 'F':
      throw std::runtime_error(
          "pixels must be 8- or 16-bit unsigned, got floating point (PFM); convert it to PGM or "
          "PNG");
    case '7':
      throw std::runtime_error("is a PAM picture, which libocc does not read; convert it to PNG");
    default:
      throw std::runtime_error(
          "is a PBM picture of 1 bit per pixel, which libocc does not read; convert it to PGM or "
          "PNG");
  }
}

template <typename T>
void read_text(NumberReader& numbers, std::uint32_t max_value, std::vector<T>& out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    const std::uint32_t value = numbers.next("sample");
    if (value > max_value) {
      throw std::runtime_error("has a sample of " + std::to_string(value) +
                               ", above the maximum of its header, " + std::to_string(max_value));
    }
    out[i] = static_cast<T>(value);
  }
}

/// Converts in place between the order of bytes in the file and that in images.
template <typename T>
void reorder(T* samples, std::size_t count) {
  if (sizeof(T) == 2 && little_endian) {
    for (std::size_t i = 0; i < count; ++i) {
      samples[i] = static_cast<T>(samples[i] << 8 | samples[i] >> 8);
    }
  }
}

template <typename T>
void read_binary(std::string_view bytes, std::vector<T>& out) {
  if (bytes.size() / sizeof(T) < out.size()) throw std::runtime_error("is truncated: few pixels");
  std::memcpy(out.data(), bytes.data(), out.size() * sizeof(T));
  reorder(out.data(), out.size());
}

template <typename T>
void append_rows(const ImageView& image, std::vector<unsigned char>& bytes) {
  const std::size_t row_bytes = image_row_bytes(image);
  std::vector<T> row(row_bytes / sizeof(T));
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(row.data(), image_row(image, y), row_bytes);
    reorder(row.data(), row.size());
    const auto* first = reinterpret_cast<const unsigned char*>(row.data());
    bytes.insert(bytes.end(), first, first + row_bytes);
  }
}

}  // namespace

Image decode_pnm(std::string_view bytes) {
  const int channels = channels_of_kind(bytes[1]);
  const bool is_text = bytes[1] < '4';
  NumberReader numbers(bytes);
  const std::uint32_t width = numbers.next("width"), height = numbers.next("height");
  const std::uint32_t max_value = numbers.next("maximum");
  check_image_size(width, height);
  if (max_value == 0 || max_value > 65535) {
    throw std::runtime_error("maximum must be 1 to 65535, got " + std::to_string(max_value));
  }
  const bool deep = max_value > 255;
  const std::uint64_t samples = std::uint64_t{width} * height * static_cast<unsigned>(channels);
  const unsigned sample_bytes = is_text || deep ? 2 : 1;  // text: a digit and white space
  check_file_length(samples * sample_bytes, bytes.size() + 1, 1);
  Image image = make_image(static_cast<int>(width), static_cast<int>(height), channels,
                           deep ? PixelType::u16 : PixelType::u8);
  if (is_text) {
    deep ? read_text(numbers, max_value, image.u16) : read_text(numbers, max_value, image.u8);
  } else {
    deep ? read_binary(numbers.rest(), image.u16) : read_binary(numbers.rest(), image.u8);
  }
  return image;
}

std::vector<unsigned char> encode_pnm(const ImageView& image) {
  const bool deep = image.type == PixelType::u16;
  const std::string header = std::string(image.channels == 1 ? "P5\n" : "P6\n") +
                             std::to_string(image.width) + ' ' + std::to_string(image.height) +
                             (deep ? "\n65535\n" : "\n255\n");
  std::vector<unsigned char> bytes(header.begin(), header.end());
  bytes.reserve(header.size() + image_row_bytes(image) * static_cast<std::size_t>(image.height));
  deep ? append_rows<std::uint16_t>(image, bytes) : append_rows<std::uint8_t>(image, bytes);
  return bytes;
}

}  // namespace occ::internal::core
