// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/image_file.hpp"

#include <algorithm>
#include <cctype>
#include <stdexcept>

#include "libocc/core/internal/file.hpp"
#include "libocc/core/internal/image_codecs.hpp"
#include "libocc/core/internal/whole_file.hpp"

namespace occ {

using namespace internal::core;

namespace {

struct Encoder {
  const char* extension;
  const char* channels;  ///< those that the format stores
  bool holds_16_bits;
  std::vector<unsigned char> (*encode)(const ImageView& image);
};

constexpr Encoder encoders[] = {
    {".png", "134", true, encode_png},   {".jpg", "13", false, encode_jpeg},
    {".jpeg", "13", false, encode_jpeg}, {".tif", "134", true, encode_tiff},
    {".tiff", "134", true, encode_tiff}, {".pgm", "1", true, encode_pnm},
    {".ppm", "3", true, encode_pnm},     {".pnm", "13", true, encode_pnm},
};

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

/// Extension with its dot; empty when the name has none.
std::string extension_of(const std::string& path) {
  const std::size_t dot = path.find_last_of("./");
  return dot == std::string::npos || path[dot] == '/' ? "" : path.substr(dot);
}

const Encoder& find_encoder(const std::string& extension) {
  std::string known;
  for (const Encoder& encoder : encoders) {
    if (lower_case(extension) == encoder.extension) return encoder;
    known += std::string(known.empty() ? "" : ", ") + encoder.extension;
  }
  throw std::runtime_error("cannot be encoded as \"" + extension + "\"; the formats are " + known);
}

Image decode(const std::string& bytes) {
  if (const char* reason = missing_end(bytes)) throw std::runtime_error(reason);
  switch (image_format(bytes)) {
    case ImageFormat::png:
      return decode_png(bytes);
    case ImageFormat::jpeg:
      return decode_jpeg(bytes);
    case ImageFormat::tiff:
      return decode_tiff(bytes);
    case ImageFormat::pnm:
      return decode_pnm(bytes);
    case ImageFormat::other:
      break;
  }
  throw std::runtime_error(unsupported_format(bytes));
}

}  // namespace

Image read_image(const std::string& path) {
  const std::string bytes = read_file(path);
  try {
    return decode(bytes);
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(path + ": " + error.what());
  }
}

std::vector<unsigned char> encode_image(const std::string& extension, const ImageView& image) {
  image.validate();
  const Encoder& encoder = find_encoder(extension);
  if (image.type == PixelType::u16 && !encoder.holds_16_bits) {
    throw std::runtime_error("16-bit pixels need .png, .tiff, .pgm or .ppm, got \"" + extension +
                             '"');
  }
  const std::string channels = std::to_string(image.channels);
  if (std::string(encoder.channels).find(channels) == std::string::npos) {
    throw std::runtime_error('"' + extension + "\" cannot store " + channels +
                             "-channel images; use .png or .tiff");
  }
  return encoder.encode(image);
}

void write_image(const std::string& path, const ImageView& image) {
  const std::vector<unsigned char> bytes = [&] {
    try {
      return encode_image(extension_of(path), image);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(path + ": " + error.what());
    }
  }();
  write_file(path, bytes.data(), bytes.size());
}

}  // namespace occ
