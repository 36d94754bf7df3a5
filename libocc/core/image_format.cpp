// SPDX-License-Identifier: Apache-2.0
// Formats of image files by their signatures, and what the decoders share.
#include <cstring>
#include <exception>

#include "libocc/core/internal/image_codecs.hpp"

namespace occ::internal::core {

namespace {

using namespace std::string_view_literals;

struct Signature {
  std::size_t at;
  std::string_view bytes;
  const char* name;
  const char* advice;
};

constexpr const char* convert = "convert it to PNG or JPEG";
constexpr const char* heic =
    "convert it to JPEG or PNG, e.g. with heif-convert, or set the phone's camera to \"most "
    "compatible\"";
constexpr const char* raw = "develop it to a 16-bit TIFF or PNG, e.g. with dcraw or darktable";
constexpr const char* video = "extract its frames as PNG files, e.g. with ffmpeg";
constexpr const char* document = "export the picture in it as PNG or JPEG";

/// Signatures from the formats' specifications; `ftyp` brands from ISO/IEC 14496-12 and 23008-12.
/// The first match counts.
constexpr Signature signatures[] = {
    {4, "ftyphei"sv, "a HEIC picture", heic},
    {4, "ftyphev"sv, "a HEIC picture", heic},
    {4, "ftypmif1"sv, "a HEIF picture", heic},
    {4, "ftypmsf1"sv, "a HEIF picture", heic},
    {4, "ftypavi"sv, "an AVIF picture", convert},
    {4, "ftypcrx "sv, "a raw file of a camera (CR3)", raw},
    {4, "ftyp"sv, "a video file (MP4, MOV)", video},
    {0, "\0\0\0\x0CjP  "sv, "a JPEG 2000 picture", convert},
    {0, "\xFF\x4F\xFF\x51"sv, "a JPEG 2000 picture", convert},
    {0, "\0\0\0\x0CJXL "sv, "a JPEG XL picture", convert},
    {0, "\xFF\x0A"sv, "a JPEG XL picture", convert},
    {8, "WEBP"sv, "a WebP picture", convert},
    {8, "AVI "sv, "a video file (AVI)", video},
    {0, "GIF8"sv, "a GIF picture", convert},
    {0, "BM"sv, "a BMP picture", convert},
    {0, "\x76\x2F\x31\x01"sv, "an OpenEXR picture", "convert it to a 16-bit PNG or TIFF"},
    {0, "#?RADIANCE"sv, "a Radiance HDR picture", "convert it to a 16-bit PNG or TIFF"},
    {0, "8BPS"sv, "a Photoshop document", document},
    {0, "%PDF"sv, "a PDF document", document},
    {0, "FUJIFILMCCD-RAW"sv, "a raw file of a camera (RAF)", raw},
    {0, "IIU\0"sv, "a raw file of a camera (RW2)", raw},
    {0, "IIRO"sv, "a raw file of a camera (ORF)", raw},
    {0, "\x93NUMPY"sv, "a NumPy array", "save it as PNG with libocc.write_image()"},
    {0, "\x1A\x45\xDF\xA3"sv, "a video file (Matroska, WebM)", video},
    {0, "PK\x03\x04"sv, "a ZIP archive", "unpack it first"},
    {0, "\x1F\x8B"sv, "a gzip archive", "unpack it first"},
    {0, "<svg"sv, "an SVG drawing", convert},
    {0, "<?xml"sv, "an XML document", convert},
    {0, "<!DOCTYPE"sv, "a web page", "download the picture itself"},
    {0, "<html"sv, "a web page", "download the picture itself"},
};

bool has(std::string_view bytes, std::size_t at, std::string_view signature) {
  return bytes.size() >= at && bytes.substr(at, signature.size()) == signature;
}

bool is_pnm(std::string_view bytes) {
  constexpr std::string_view kinds = "1234567fF", separators = " \t\r\n\v\f#";
  return bytes.size() > 2 && bytes[0] == 'P' && kinds.find(bytes[1]) != kinds.npos &&
         separators.find(bytes[2]) != separators.npos;
}

}  // namespace

ImageFormat image_format(std::string_view bytes) {
  if (has(bytes, 0, "\x89PNG\r\n\x1a\n"sv)) return ImageFormat::png;
  if (has(bytes, 0, "\xFF\xD8\xFF"sv)) return ImageFormat::jpeg;
  for (const std::string_view tiff : {"II*\0"sv, "MM\0*"sv, "II+\0"sv, "MM\0+"sv}) {
    if (has(bytes, 0, tiff)) return ImageFormat::tiff;
  }
  return is_pnm(bytes) ? ImageFormat::pnm : ImageFormat::other;
}

std::string unsupported_format(std::string_view bytes) {
  if (bytes.empty()) return "is empty, not an image";
  for (const Signature& format : signatures) {
    if (has(bytes, format.at, format.bytes)) {
      return std::string("is ") + format.name + ", which libocc does not read; " + format.advice;
    }
  }
  return "is not an image that libocc reads (PNG, JPEG, TIFF, PGM or PPM)";
}

void check_image_size(std::uint64_t width, std::uint64_t height) {
  if (width > 0 && height > 0 && width <= max_image_pixels && height <= max_image_pixels / width) {
    return;
  }
  throw std::runtime_error("has a header that gives " + std::to_string(width) + " x " +
                           std::to_string(height) + " pixels; 1 to " +
                           std::to_string(max_image_pixels) + " pixels are allowed");
}

void check_file_length(std::uint64_t pixel_bytes, std::uint64_t file_bytes, unsigned max_ratio) {
  if (pixel_bytes / max_ratio <= file_bytes) return;
  throw std::runtime_error("is truncated or has a corrupt header: " + std::to_string(file_bytes) +
                           " bytes cannot contain " + std::to_string(pixel_bytes) +
                           " bytes of pixels");
}

Image make_image(int width, int height, int channels, PixelType type) {
  Image image;
  image.width = width;
  image.height = height;
  image.channels = channels;
  image.type = type;
  const std::size_t count = static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
                            static_cast<std::size_t>(channels);
  if (type == PixelType::u8) {
    image.u8.resize(count);
  } else {
    image.u16.resize(count);
  }
  return image;
}

std::size_t image_row_bytes(const ImageView& image) {
  return static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels) *
         (image.type == PixelType::u8 ? 1u : 2u);
}

std::size_t image_row_bytes(const Image& image) { return image_row_bytes(image.view()); }

unsigned char* image_row(Image& image, int y) {
  void* pixels = image.type == PixelType::u8 ? static_cast<void*>(image.u8.data())
                                             : static_cast<void*>(image.u16.data());
  return static_cast<unsigned char*>(pixels) + static_cast<std::size_t>(y) * image_row_bytes(image);
}

const unsigned char* image_row(const ImageView& image, int y) {
  return static_cast<const unsigned char*>(image.data) +
         static_cast<std::size_t>(y) * image.row_bytes;
}

bool append_bytes(std::vector<unsigned char>& out, const void* bytes, std::size_t count) noexcept {
  const auto* first = static_cast<const unsigned char*>(bytes);
  try {
    out.insert(out.end(), first, first + count);
    return true;
  } catch (const std::exception&) {
    return false;
  }
}

}  // namespace occ::internal::core
