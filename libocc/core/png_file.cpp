// SPDX-License-Identifier: Apache-2.0
// PNG files with libpng. Functions that libpng's errors leave by longjmp hold plain data only.
#include <png.h>
#include <zlib.h>

#include <cstring>

#include "libocc/core/internal/image_codecs.hpp"

namespace occ::internal::core {

namespace {

/// A deflate stream yields at most 258 bytes for 2 bits (zlib's technical details: 1032 to 1).
constexpr unsigned max_deflate_ratio = 1032;

struct PngReader : LibraryError {
  explicit PngReader(std::string_view file) : left(file) {}
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;
  ~PngReader() { png_destroy_read_struct(&png, &info, nullptr); }

  std::string_view left;  ///< bytes not yet read
  png_structp png = nullptr;
  png_infop info = nullptr;
  int passes = 1;
  unsigned char* pixels = nullptr;
  std::size_t row_bytes = 0;
};

struct PngWriter : LibraryError {
  explicit PngWriter(const ImageView& pixels) : image(pixels) {}
  PngWriter(const PngWriter&) = delete;
  PngWriter& operator=(const PngWriter&) = delete;
  ~PngWriter() { png_destroy_write_struct(&png, &info); }

  const ImageView& image;
  png_structp png = nullptr;
  png_infop info = nullptr;
  std::vector<unsigned char> bytes;
};

/// Also the handler of warnings: those of the chunks that are read report corrupt data.
[[noreturn]] void on_error(png_structp png, png_const_charp reason) {
  static_cast<LibraryError*>(png_get_error_ptr(png))->leave(reason);
}

void read_bytes(png_structp png, png_bytep out, std::size_t count) {
  auto& left = static_cast<PngReader*>(png_get_io_ptr(png))->left;
  if (count > left.size()) png_error(png, "the file ends too early");
  std::memcpy(out, left.data(), count);
  left.remove_prefix(count);
}

/// Reads up to the pixels. Ignores every chunk that does not affect them: many programs write, for
/// example, faulty colour profiles.
void read_header(PngReader& reader) {
  reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, static_cast<LibraryError*>(&reader),
                                      on_error, on_error);
  if (reader.png == nullptr) reader.leave("libpng cannot be started");
  reader.info = png_create_info_struct(reader.png);
  if (reader.info == nullptr) reader.leave("out of memory");
  png_set_read_fn(reader.png, &reader, read_bytes);
  png_set_user_limits(reader.png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);  // see check_image_size()
  png_set_keep_unknown_chunks(reader.png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_set_benign_errors(reader.png, 0);
  png_read_info(reader.png, reader.info);
}

/// Sets the conversion to 8 or 16 bits and 1, 3 or 4 channels. Grey with alpha becomes colour with
/// alpha; a transparent level of a grey image is ignored, because it is an ordinary grey level too.
void set_conversion(PngReader& reader) {
  const int type = png_get_color_type(reader.png, reader.info);
  const int bits = png_get_bit_depth(reader.png, reader.info);
  const bool has_transparency = png_get_valid(reader.png, reader.info, PNG_INFO_tRNS) != 0;
  if (bits == 16 && little_endian) png_set_swap(reader.png);
  if (type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(reader.png);
  if (type == PNG_COLOR_TYPE_GRAY && bits < 8) png_set_expand_gray_1_2_4_to_8(reader.png);
  if (type == PNG_COLOR_TYPE_GRAY_ALPHA) png_set_gray_to_rgb(reader.png);
  if ((type & PNG_COLOR_MASK_COLOR) != 0 && has_transparency) png_set_tRNS_to_alpha(reader.png);
  reader.passes = png_set_interlace_handling(reader.png);
  png_read_update_info(reader.png, reader.info);
}

void read_pixels(PngReader& reader) {
  const png_uint_32 height = png_get_image_height(reader.png, reader.info);
  for (int pass = 0; pass < reader.passes; ++pass) {
    unsigned char* row = reader.pixels;
    for (png_uint_32 y = 0; y < height; ++y, row += reader.row_bytes) {
      png_read_row(reader.png, row, nullptr);
    }
  }
  png_read_end(reader.png, nullptr);
}

void write_bytes(png_structp png, png_bytep bytes, std::size_t count) {
  auto& out = static_cast<PngWriter*>(png_get_io_ptr(png))->bytes;
  if (!append_bytes(out, bytes, count)) png_error(png, "out of memory");
}

void flush_bytes(png_structp) {}

/// Fast settings: pixels of a camera are noisy, so stronger compression gains little.
void set_compression(PngWriter& writer) {
  png_set_filter(writer.png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_compression_level(writer.png, Z_BEST_SPEED);
  png_set_compression_strategy(writer.png, Z_RLE);
}

void write_png(PngWriter& writer) {
  const ImageView& image = writer.image;
  writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, static_cast<LibraryError*>(&writer),
                                       on_error, on_error);
  if (writer.png == nullptr) writer.leave("libpng cannot be started");
  writer.info = png_create_info_struct(writer.png);
  if (writer.info == nullptr) writer.leave("out of memory");
  png_set_write_fn(writer.png, &writer, write_bytes, flush_bytes);
  png_set_user_limits(writer.png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  set_compression(writer);
  const int type = image.channels == 1   ? PNG_COLOR_TYPE_GRAY
                   : image.channels == 3 ? PNG_COLOR_TYPE_RGB
                                         : PNG_COLOR_TYPE_RGB_ALPHA;
  const bool deep = image.type == PixelType::u16;
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(image.width),
               static_cast<png_uint_32>(image.height), deep ? 16 : 8, type, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(writer.png, writer.info);
  if (deep && little_endian) png_set_swap(writer.png);
  for (int y = 0; y < image.height; ++y) png_write_row(writer.png, image_row(image, y));
  png_write_end(writer.png, writer.info);
}

}  // namespace

Image decode_png(std::string_view bytes) {
  constexpr const char* what = "cannot be decoded as PNG";
  PngReader reader(bytes);
  run_library(reader, read_header, what);
  const png_uint_32 width = png_get_image_width(reader.png, reader.info);
  const png_uint_32 height = png_get_image_height(reader.png, reader.info);
  check_image_size(width, height);
  const std::uint64_t stored = std::uint64_t{height} * png_get_rowbytes(reader.png, reader.info);
  check_file_length(stored, bytes.size(), max_deflate_ratio);
  run_library(reader, set_conversion, what);
  const bool deep = png_get_bit_depth(reader.png, reader.info) == 16;
  Image image =
      make_image(static_cast<int>(width), static_cast<int>(height),
                 png_get_channels(reader.png, reader.info), deep ? PixelType::u16 : PixelType::u8);
  reader.row_bytes = image_row_bytes(image);
  if (reader.row_bytes != png_get_rowbytes(reader.png, reader.info)) {
    throw std::runtime_error("cannot be decoded as PNG: unexpected length of a row");
  }
  reader.pixels = image_row(image, 0);
  run_library(reader, read_pixels, what);
  return image;
}

std::vector<unsigned char> encode_png(const ImageView& image) {
  PngWriter writer(image);
  run_library(writer, write_png, "cannot be encoded as PNG");
  return std::move(writer.bytes);
}

}  // namespace occ::internal::core
