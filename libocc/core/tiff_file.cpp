// SPDX-License-Identifier: Apache-2.0
// TIFF files with libtiff: strips and tiles, interleaved and separate planes, 8 and 16 bits.
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstring>
#include <limits>
#include <memory>

#include "libocc/core/internal/image_codecs.hpp"

namespace occ::internal::core {

namespace {

/// LZW codes of 12 bits stand for at most 3839 bytes, a string that grew by one byte per code:
/// 2560 to 1. Deflate reaches 1032 to 1.
constexpr unsigned max_ratio = 2560;

/// A file in memory. Members that libtiff reaches by pointer.
struct TiffMemory {
  std::string_view in;             ///< for reading
  std::vector<unsigned char> out;  ///< for writing
  std::uint64_t at = 0;
  bool writes = false;
  char error[200] = "";  ///< the first one; later ones follow from it

  std::uint64_t size() const { return writes ? out.size() : in.size(); }
};

tmsize_t read_bytes(thandle_t handle, void* to, tmsize_t count) {
  auto& file = *static_cast<TiffMemory*>(handle);
  if (file.at >= file.size() || count <= 0) return 0;
  const auto n = std::min(static_cast<std::uint64_t>(count), file.size() - file.at);
  const void* from = file.writes ? static_cast<const void*>(file.out.data() + file.at)
                                 : static_cast<const void*>(file.in.data() + file.at);
  std::memcpy(to, from, n);
  file.at += n;
  return static_cast<tmsize_t>(n);
}

tmsize_t write_bytes(thandle_t handle, void* from, tmsize_t count) {
  auto& file = *static_cast<TiffMemory*>(handle);
  if (!file.writes || count <= 0) return 0;
  const auto n = static_cast<std::size_t>(count);
  while (file.at > file.out.size()) {  // libtiff aligns its directory to 2 bytes
    if (!append_bytes(file.out, "", 1)) return 0;
  }
  const std::size_t over = std::min<std::size_t>(n, file.out.size() - file.at);
  if (over > 0) std::memcpy(file.out.data() + file.at, from, over);
  if (!append_bytes(file.out, static_cast<const unsigned char*>(from) + over, n - over)) return 0;
  file.at += n;
  return count;
}

toff_t seek(thandle_t handle, toff_t offset, int origin) {
  auto& file = *static_cast<TiffMemory*>(handle);
  const std::uint64_t start = origin == SEEK_SET ? 0 : origin == SEEK_CUR ? file.at : file.size();
  return file.at = start + offset;
}

int close_nothing(thandle_t) { return 0; }

toff_t size_of(thandle_t handle) { return static_cast<TiffMemory*>(handle)->size(); }

/// Returns 1: libtiff's own handler, which prints, is not called.
int on_error(TIFF*, void* memory, const char* place, const char* format, std::va_list arguments) {
  auto& error = static_cast<TiffMemory*>(memory)->error;
  if (error[0] != '\0') return 1;
  const int used = place == nullptr ? 0 : std::snprintf(error, sizeof error, "%s: ", place);
  const auto start = std::min(static_cast<std::size_t>(std::max(used, 0)), sizeof error - 1);
  std::vsnprintf(error + start, sizeof error - start, format, arguments);
  return 1;
}

/// Unknown tags and the like, which do not affect pixels.
int on_warning(TIFF*, void*, const char*, const char*, std::va_list) { return 1; }

struct Close {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
  void operator()(TIFFOpenOptions* options) const { TIFFOpenOptionsFree(options); }
};
using Tiff = std::unique_ptr<TIFF, Close>;

[[noreturn]] void fail(const TiffMemory& memory, const char* what) {
  throw std::runtime_error(std::string(what) + ": " +
                           (memory.error[0] == '\0' ? "unknown error" : memory.error));
}

Tiff open(TiffMemory& memory, const char* mode, std::uint64_t max_allocation, const char* what) {
  const std::unique_ptr<TIFFOpenOptions, Close> options(TIFFOpenOptionsAlloc());
  if (options == nullptr) fail(memory, what);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), on_error, &memory);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), on_warning, nullptr);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), static_cast<tmsize_t>(max_allocation));
  Tiff tiff(TIFFClientOpenExt("image", mode, &memory, read_bytes, write_bytes, seek, close_nothing,
                              size_of, nullptr, nullptr, options.get()));
  if (tiff == nullptr) fail(memory, what);
  return tiff;
}

std::uint16_t tag(TIFF* tiff, std::uint32_t name) {
  std::uint16_t value = 0;
  return TIFFGetFieldDefaulted(tiff, name, &value) == 1 ? value : std::uint16_t{0};
}

std::uint32_t long_tag(TIFF* tiff, std::uint32_t name) {
  std::uint32_t value = 0;
  return TIFFGetFieldDefaulted(tiff, name, &value) == 1 ? value : 0;
}

/// Pixels of one image, in blocks: strips (of the image's width) or tiles.
struct Layout {
  std::uint32_t width, height;
  std::uint32_t block_width, block_height;
  unsigned samples;  ///< per pixel
  unsigned bits;
  bool tiled;
  bool separate;  ///< one plane per sample
  bool white_is_zero;
  std::uint64_t stored_bytes;  ///< size of all pixels before compression
};

[[noreturn]] void refuse(const std::string& reason) {
  throw std::runtime_error("is a TIFF picture with " + reason);
}

void check_compression(TIFF* tiff) {
  const unsigned compression = tag(tiff, TIFFTAG_COMPRESSION);
  for (const unsigned known :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_DEFLATE}) {
    if (compression == known) return;
  }
  refuse("compression " + std::to_string(compression) +
         "; none (1), LZW (5) and deflate (8, 32946) are read");
}

void check_samples(TIFF* tiff, const Layout& layout) {
  const unsigned format = tag(tiff, TIFFTAG_SAMPLEFORMAT);
  if (format != SAMPLEFORMAT_UINT || (layout.bits != 8 && layout.bits != 16)) {
    const char* kind = format == SAMPLEFORMAT_IEEEFP ? " floating point"
                       : format == SAMPLEFORMAT_INT  ? " signed"
                                                     : "";
    refuse("another pixel type: pixels must be 8- or 16-bit unsigned, got " +
           std::to_string(layout.bits) + "-bit" + kind);
  }
  std::uint16_t colours = 0;
  if (TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &colours) != 1) refuse("no photometric tag");
  const bool is_grey = colours == PHOTOMETRIC_MINISBLACK || colours == PHOTOMETRIC_MINISWHITE;
  if (!is_grey && colours != PHOTOMETRIC_RGB) {
    refuse("photometric " + std::to_string(colours) + "; grey (0, 1) and RGB (2) are read");
  }
  if (is_grey ? layout.samples != 1 : layout.samples != 3 && layout.samples != 4) {
    refuse(std::to_string(layout.samples) + " channels; grey has 1, RGB has 3 or 4");
  }
}

/// Raw files of cameras are often TIFF files whose first image is a thumbnail.
void check_first_image(TIFF* tiff) {
  const unsigned char* version = nullptr;
  if (TIFFGetField(tiff, TIFFTAG_DNGVERSION, &version) == 1) {
    throw std::runtime_error(
        "is a raw file of a camera (DNG), which libocc does not read; develop it to a 16-bit TIFF "
        "or PNG, e.g. with dcraw or darktable");
  }
  if ((long_tag(tiff, TIFFTAG_SUBFILETYPE) & FILETYPE_REDUCEDIMAGE) != 0) {
    refuse("a thumbnail first (a raw file of a camera?); convert it to a 16-bit TIFF or PNG");
  }
}

std::uint64_t block_bytes(const Layout& layout) {
  const unsigned samples = layout.separate ? 1 : layout.samples;
  return std::uint64_t{layout.block_width} * layout.block_height * samples * (layout.bits / 8);
}

/// All tiles of a row or column are stored complete.
std::uint64_t padded(std::uint64_t length, std::uint64_t block) {
  return (length + block - 1) / block * block;
}

Layout read_layout(TIFF* tiff, std::uint64_t file_bytes) {
  check_first_image(tiff);
  check_compression(tiff);
  Layout layout{};
  layout.width = long_tag(tiff, TIFFTAG_IMAGEWIDTH);
  layout.height = long_tag(tiff, TIFFTAG_IMAGELENGTH);
  layout.samples = tag(tiff, TIFFTAG_SAMPLESPERPIXEL);
  layout.bits = tag(tiff, TIFFTAG_BITSPERSAMPLE);
  layout.separate = tag(tiff, TIFFTAG_PLANARCONFIG) == PLANARCONFIG_SEPARATE;
  layout.white_is_zero = tag(tiff, TIFFTAG_PHOTOMETRIC) == PHOTOMETRIC_MINISWHITE;
  layout.tiled = TIFFIsTiled(tiff) != 0;
  check_samples(tiff, layout);
  check_image_size(layout.width, layout.height);
  if (layout.tiled) {
    layout.block_width = long_tag(tiff, TIFFTAG_TILEWIDTH);
    layout.block_height = long_tag(tiff, TIFFTAG_TILELENGTH);
  } else {
    layout.block_width = layout.width;
    layout.block_height = std::min(long_tag(tiff, TIFFTAG_ROWSPERSTRIP), layout.height);
  }
  check_image_size(layout.block_width, layout.block_height);
  const std::uint64_t height =
      layout.tiled ? padded(layout.height, layout.block_height) : layout.height;
  layout.stored_bytes =
      padded(layout.width, layout.block_width) * height * layout.samples * (layout.bits / 8);
  const bool compressed = tag(tiff, TIFFTAG_COMPRESSION) != COMPRESSION_NONE;
  check_file_length(layout.stored_bytes, file_bytes, compressed ? max_ratio : 1);
  return layout;
}

struct Block {
  std::uint32_t x, y, width, height;  ///< width and height inside the image
  unsigned plane;
};

/// Copies a block.
template <typename T>
void copy_block(const Layout& layout, const Block& block, const std::vector<T>& from, Image& image,
                std::vector<T>& to) {
  const unsigned stored = layout.separate ? 1 : layout.samples;
  const auto channels = static_cast<unsigned>(image.channels);
  const T flip = layout.white_is_zero ? std::numeric_limits<T>::max() : T{0};
  for (std::uint32_t y = 0; y < block.height; ++y) {
    const T* in = from.data() + std::size_t{y} * layout.block_width * stored;
    T* out = to.data() + (std::size_t{block.y + y} * layout.width + block.x) * channels;
    for (unsigned s = 0; s < stored; ++s) {
      const unsigned sample = layout.separate ? block.plane : s;
      for (std::uint32_t x = 0; x < block.width; ++x) {
        out[x * std::size_t{channels} + sample] =
            static_cast<T>(in[x * std::size_t{stored} + s] ^ flip);
      }
    }
  }
}

template <typename T>
void read_block(TIFF* tiff, const TiffMemory& memory, const Layout& layout, const Block& block,
                std::vector<T>& pixels) {
  const auto plane = static_cast<std::uint16_t>(block.plane);
  const std::uint64_t rows = layout.tiled ? layout.block_height : block.height;
  const auto bytes = static_cast<tmsize_t>(block_bytes(layout) / layout.block_height * rows);
  const tmsize_t read =
      layout.tiled ? TIFFReadEncodedTile(tiff, TIFFComputeTile(tiff, block.x, block.y, 0, plane),
                                         pixels.data(), bytes)
                   : TIFFReadEncodedStrip(tiff, TIFFComputeStrip(tiff, block.y, plane),
                                          pixels.data(), bytes);
  if (read < 0 || memory.error[0] != '\0') fail(memory, "cannot be decoded as TIFF");
  if (read != bytes) throw std::runtime_error("is truncated: a strip or tile is incomplete");
}

template <typename T>
void read_pixels(TIFF* tiff, const TiffMemory& memory, const Layout& layout, Image& image,
                 std::vector<T>& to) {
  std::vector<T> pixels(block_bytes(layout) / sizeof(T));
  Block block{};
  for (block.plane = 0; block.plane < (layout.separate ? layout.samples : 1); ++block.plane) {
    for (block.y = 0; block.y < layout.height; block.y += layout.block_height) {
      block.height = std::min(layout.block_height, layout.height - block.y);
      for (block.x = 0; block.x < layout.width; block.x += layout.block_width) {
        block.width = std::min(layout.block_width, layout.width - block.x);
        read_block(tiff, memory, layout, block, pixels);
        copy_block(layout, block, pixels, image, to);
      }
    }
  }
}

void set_tags(TIFF* tiff, const ImageView& image) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, image.width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, image.height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, image.type == PixelType::u8 ? 8 : 16);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, image.channels);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC,
               image.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  if (image.channels == 4) {
    const std::uint16_t alpha = EXTRASAMPLE_UNASSALPHA;
    TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
  }
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
  TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tiff, 0));
}

template <typename T>
void write_rows(TIFF* tiff, const TiffMemory& memory, const ImageView& image, const char* what) {
  const std::size_t row_bytes = image_row_bytes(image);
  std::vector<T> row(row_bytes / sizeof(T));  // libtiff modifies it
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(row.data(), image_row(image, y), row_bytes);
    if (TIFFWriteScanline(tiff, row.data(), static_cast<std::uint32_t>(y), 0) != 1) {
      fail(memory, what);
    }
  }
}

}  // namespace

Image decode_tiff(std::string_view bytes) {
  TiffMemory memory;
  memory.in = bytes;
  // The largest tables of libtiff hold 8 bytes per strip, stored as 2 bytes or more in the file.
  const std::uint64_t max_allocation = 4 * std::uint64_t{bytes.size()} + (1 << 20);
  const Tiff tiff = open(memory, "rm", max_allocation, "cannot be decoded as TIFF");
  const Layout layout = read_layout(tiff.get(), bytes.size());
  Image image = make_image(static_cast<int>(layout.width), static_cast<int>(layout.height),
                           static_cast<int>(layout.samples),
                           layout.bits == 8 ? PixelType::u8 : PixelType::u16);
  if (image.type == PixelType::u8) {
    read_pixels(tiff.get(), memory, layout, image, image.u8);
  } else {
    read_pixels(tiff.get(), memory, layout, image, image.u16);
  }
  return image;
}

std::vector<unsigned char> encode_tiff(const ImageView& image) {
  constexpr const char* what = "cannot be encoded as TIFF";
  TiffMemory memory;
  memory.writes = true;
  {
    const Tiff tiff = open(memory, "w", 0, what);
    set_tags(tiff.get(), image);
    if (image.type == PixelType::u8) {
      write_rows<std::uint8_t>(tiff.get(), memory, image, what);
    } else {
      write_rows<std::uint16_t>(tiff.get(), memory, image, what);
    }
    if (TIFFFlush(tiff.get()) != 1) fail(memory, what);
  }
  if (memory.error[0] != '\0') fail(memory, what);
  return std::move(memory.out);
}

}  // namespace occ::internal::core
