// SPDX-License-Identifier: Apache-2.0
// Small image files of many kinds, written with libpng, libjpeg and libtiff, and forged headers.
#pragma once

#include <cstdio>
// jpeglib.h needs <cstdio>
#include <jpeglib.h>
#include <png.h>
#include <sys/mman.h>
#include <tiffio.h>
#include <unistd.h>
#include <zlib.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "libocc/core/random.hpp"

namespace occ::test {

constexpr int sample_width = 37, sample_height = 23;

inline std::string random_bytes(std::size_t count, std::uint64_t seed) {
  Random random(seed);
  std::string bytes;
  for (std::size_t i = 0; i < count; ++i) bytes += static_cast<char>(random.bits());
  return bytes;
}

/// A file in memory: tests write thousands of files.
class MemoryFile {
 public:
  MemoryFile() : file_(::memfd_create("image", 0)) {}
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { ::close(file_); }

  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

  /// Replaces the content; returns the path.
  std::string with(const std::string& bytes) const {
    const bool empty = ::ftruncate(file_, 0) == 0;
    const ssize_t written = ::pwrite(file_, bytes.data(), bytes.size(), 0);
    if (!empty || written != static_cast<ssize_t>(bytes.size())) {
      throw std::runtime_error("a file in memory cannot be written");
    }
    return path();
  }

 private:
  int file_;
};

struct PngKind {
  int type = PNG_COLOR_TYPE_GRAY;
  int bits = 8;
  bool interlaced = false;
  bool transparent = false;  ///< has the chunk tRNS
};

inline void set_palette(png_structp png, png_infop info, const PngKind& kind) {
  const std::string random = random_bytes(1024, 3);
  png_color colours[256];
  for (std::size_t i = 0; i < 256; ++i) std::memcpy(&colours[i], random.data() + 3 * i, 3);
  const int count = 1 << kind.bits;
  if (kind.type == PNG_COLOR_TYPE_PALETTE) png_set_PLTE(png, info, colours, count);
  png_color_16 level{0, 1, 1, 1, 1};
  auto* alpha = reinterpret_cast<png_const_bytep>(random.data());
  if (kind.transparent) png_set_tRNS(png, info, alpha, count - 1, &level);
}

inline std::string png_sample(const PngKind& kind, int width = sample_width,
                              int height = sample_height) {
  std::string bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  const auto append = [](png_structp writer, png_bytep data, std::size_t count) {
    static_cast<std::string*>(png_get_io_ptr(writer))->append(reinterpret_cast<char*>(data), count);
  };
  png_set_write_fn(png, &bytes, append, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height),
               kind.bits, kind.type, kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  set_palette(png, info, kind);
  png_write_info(png, info);
  const std::size_t row = png_get_rowbytes(png, info);
  const std::string pixels = random_bytes(row * static_cast<std::size_t>(height), 1);
  std::vector<png_bytep> rows;
  for (int y = 0; y < height; ++y) {
    rows.push_back(const_cast<png_bytep>(
        reinterpret_cast<png_const_bytep>(pixels.data() + static_cast<std::size_t>(y) * row)));
  }
  png_write_image(png, rows.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  return bytes;
}

inline std::vector<PngKind> png_kinds() {
  std::vector<PngKind> kinds;
  for (const int type : {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_PALETTE, PNG_COLOR_TYPE_RGB,
                         PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB_ALPHA}) {
    for (const int bits : {1, 2, 4, 8, 16}) {
      const bool has_palette = type == PNG_COLOR_TYPE_PALETTE;
      if (has_palette ? bits == 16 : bits < 8 && type != PNG_COLOR_TYPE_GRAY) continue;
      for (const bool interlaced : {false, true}) {
        kinds.push_back({type, bits, interlaced, false});
        if ((type & PNG_COLOR_MASK_ALPHA) == 0) kinds.push_back({type, bits, interlaced, true});
      }
    }
  }
  return kinds;
}

struct JpegKind {
  int channels = 3;
  int horizontal = 2, vertical = 2;  ///< sampling of the first component
  bool progressive = false;
  bool separate_scans = false;
  bool arithmetic = false;
  unsigned restart = 0;  ///< blocks between restart markers
  J_COLOR_SPACE stored = JCS_YCbCr;
  int quality = 90;
};

inline std::string jpeg_sample(const JpegKind& kind, int width = sample_width,
                               int height = sample_height) {
  jpeg_compress_struct info{};
  jpeg_error_mgr manager{};
  info.err = jpeg_std_error(&manager);
  jpeg_create_compress(&info);
  unsigned char* out = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&info, &out, &size);
  info.image_width = static_cast<JDIMENSION>(width);
  info.image_height = static_cast<JDIMENSION>(height);
  info.input_components = kind.channels;
  info.in_color_space = kind.channels == 1   ? JCS_GRAYSCALE
                        : kind.channels == 3 ? JCS_RGB
                                             : JCS_CMYK;
  jpeg_set_defaults(&info);
  if (kind.channels == 3) jpeg_set_colorspace(&info, kind.stored);
  info.comp_info[0].h_samp_factor = kind.horizontal;
  info.comp_info[0].v_samp_factor = kind.vertical;
  info.restart_interval = kind.restart;
  info.arith_code = kind.arithmetic ? TRUE : FALSE;
  jpeg_set_quality(&info, kind.quality, TRUE);
  if (kind.progressive) jpeg_simple_progression(&info);
  jpeg_scan_info scans[3] = {};
  for (int i = 0; i < 3; ++i) scans[i] = {1, {i, 0, 0, 0}, 0, 63, 0, 0};
  if (kind.separate_scans) {
    info.scan_info = scans;
    info.num_scans = kind.channels;
  }
  jpeg_start_compress(&info, TRUE);
  const auto row_bytes = static_cast<std::size_t>(width * kind.channels);
  const std::string noise = random_bytes(row_bytes, 2);
  for (int y = 0; y < height; ++y) {  // a gradient with noise
    std::vector<unsigned char> row(row_bytes);
    for (std::size_t i = 0; i < row_bytes; ++i) {
      row[i] = static_cast<unsigned char>(3 * i + 5 * static_cast<unsigned>(y) +
                                          static_cast<unsigned char>(noise[i]) / 4);
    }
    JSAMPROW pointer = row.data();
    jpeg_write_scanlines(&info, &pointer, 1);
  }
  jpeg_finish_compress(&info);
  std::string bytes(reinterpret_cast<char*>(out), size);
  jpeg_destroy_compress(&info);
  std::free(out);
  return bytes;
}

inline std::vector<JpegKind> jpeg_kinds() {
  std::vector<JpegKind> kinds;
  for (const bool progressive : {false, true}) {
    for (const unsigned restart : {0u, 2u}) {
      for (const auto& [h, v] : {std::pair{1, 1}, {2, 1}, {1, 2}, {2, 2}, {4, 1}, {4, 2}}) {
        kinds.push_back({3, h, v, progressive, false, false, restart});
      }
      kinds.push_back({1, 1, 1, progressive, false, false, restart});
      kinds.push_back({3, 1, 1, progressive, false, false, restart, JCS_RGB});
    }
  }
  kinds.push_back({3, 2, 2, false, true});
  kinds.push_back({3, 2, 2, false, false, false, 0, JCS_YCbCr, 15});
  kinds.push_back({3, 1, 1, false, false, false, 0, JCS_YCbCr, 100});
  return kinds;
}

struct TiffKind {
  int samples = 1;
  int bits = 8;
  int compression = COMPRESSION_NONE;
  bool tiled = false;
  bool separate = false;
  int photometric = -1;  ///< default: grey with black as zero, or RGB
  int alpha = EXTRASAMPLE_ASSOCALPHA;
  const char* mode = "w";  ///< libtiff's: "wb" big-endian, "w8" BigTIFF
  int sample_format = SAMPLEFORMAT_UINT;
  int orientation = 0;
  bool is_thumbnail = false;
  bool is_dng = false;
};

inline void set_sample_tags(TIFF* tiff, const TiffKind& kind) {
  const bool is_grey = kind.samples < 3;
  const int photometric = kind.photometric >= 0 ? kind.photometric
                          : is_grey             ? PHOTOMETRIC_MINISBLACK
                                                : PHOTOMETRIC_RGB;
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, sample_width);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, sample_height);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bits);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.samples);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.sample_format);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG,
               kind.separate ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, photometric);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
  if (kind.samples == 2 || kind.samples == 4) {
    const auto alpha = static_cast<std::uint16_t>(kind.alpha);
    if (photometric != PHOTOMETRIC_SEPARATED) TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &alpha);
  }
  if (photometric == PHOTOMETRIC_PALETTE) {
    std::vector<std::uint16_t> map(256, 7);
    TIFFSetField(tiff, TIFFTAG_COLORMAP, map.data(), map.data(), map.data());
  }
  if (kind.orientation > 0) TIFFSetField(tiff, TIFFTAG_ORIENTATION, kind.orientation);
  if (kind.is_thumbnail) TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
  const unsigned char version[] = {1, 4, 0, 0};
  if (kind.is_dng) TIFFSetField(tiff, TIFFTAG_DNGVERSION, version);
}

/// Sample s of pixel (x, y) of a TIFF sample: colour in the order of the file.
inline unsigned tiff_value(int x, int y, int s, int bits) {
  const auto mixed = static_cast<unsigned>(x * 7919 + y * 104729 + s * 1299709) * 2654435761u;
  return (mixed >> 13) & ((1u << bits) - 1);
}

inline void append_value(std::string& block, const TiffKind& kind, int x, int y, int s) {
  if (kind.bits == 8) block += static_cast<char>(tiff_value(x, y, s, 8));
  if (kind.bits < 8 && x % 8 == 0) block += 'x';
  if (kind.bits == 16) {
    const auto value = static_cast<std::uint16_t>(tiff_value(x, y, s, 16));
    block.append(reinterpret_cast<const char*>(&value), 2);
  }
  if (kind.bits == 32) block.append("abcd", 4);
}

inline std::string tiff_block(const TiffKind& kind, int x0, int y0, int width, int height,
                              int plane) {
  std::string block;
  for (int y = y0; y < y0 + height; ++y) {
    for (int x = x0; x < x0 + width; ++x) {
      for (int s = 0; s < (kind.separate ? 1 : kind.samples); ++s) {
        append_value(block, kind, x, y, kind.separate ? plane : s);
      }
    }
  }
  return block;
}

inline std::string tiff_sample(const TiffKind& kind) {
  const MemoryFile memory;
  const std::string path = memory.path();
  TIFF* tiff = TIFFOpen(path.c_str(), kind.mode);
  set_sample_tags(tiff, kind);
  constexpr int tile = 16, strip = 5;
  if (kind.tiled) {
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, tile);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, tile);
  } else {
    TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, strip);
  }
  const int width = kind.tiled ? tile : sample_width, rows = kind.tiled ? tile : strip;
  std::uint32_t index = 0;
  for (int plane = 0; plane < (kind.separate ? kind.samples : 1); ++plane) {
    for (int y = 0; y < sample_height; y += rows) {
      for (int x = 0; x < sample_width; x += width, ++index) {
        const int height = kind.tiled ? rows : std::min(rows, sample_height - y);
        std::string block = tiff_block(kind, x, y, width, height, plane);
        const auto size = static_cast<tmsize_t>(block.size());
        kind.tiled ? TIFFWriteEncodedTile(tiff, index, block.data(), size)
                   : TIFFWriteEncodedStrip(tiff, index, block.data(), size);
      }
    }
  }
  TIFFClose(tiff);
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::vector<TiffKind> tiff_kinds() {
  std::vector<TiffKind> kinds;
  for (const int samples : {1, 3, 4}) {
    for (const int bits : {8, 16}) {
      for (const int compression :
           {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_DEFLATE}) {
        for (const bool tiled : {false, true}) {
          for (const bool separate : {false, true}) {
            kinds.push_back({samples, bits, compression, tiled, separate});
          }
        }
      }
    }
  }
  for (const char* mode : {"wb", "w8", "wb8"}) {
    kinds.push_back({3, 16, COMPRESSION_LZW, false, false, -1, 0, mode});
  }
  kinds.push_back({1, 8, COMPRESSION_LZW, false, false, PHOTOMETRIC_MINISWHITE});
  kinds.push_back({1, 16, COMPRESSION_LZW, false, false, PHOTOMETRIC_MINISWHITE});
  kinds.push_back({4, 8, COMPRESSION_LZW, false, false, -1, EXTRASAMPLE_UNASSALPHA});
  return kinds;
}

/// Sets the value of a LONG or SHORT tag of a little-endian classic TIFF file.
inline std::string with_tiff_tag(std::string bytes, unsigned tag, std::uint32_t value) {
  std::uint32_t at = 0;
  std::memcpy(&at, bytes.data() + 4, 4);
  for (at += 2; at + 12 <= bytes.size(); at += 12) {
    std::uint16_t found = 0;
    std::memcpy(&found, bytes.data() + at, 2);
    if (found != tag) continue;
    const std::uint16_t type = 4;  // LONG
    std::memcpy(&bytes[at + 2], &type, 2);
    std::memcpy(&bytes[at + 8], &value, 4);
    return bytes;
  }
  return "no such tag";
}

inline std::string big_endian(std::uint32_t value, std::size_t bytes) {
  std::string text;
  for (std::size_t i = bytes; i-- > 0;) text += static_cast<char>(value >> 8 * i);
  return text;
}

/// Calls edit(offset of the chunk, length of its data) and then corrects the chunk's check sum.
template <class Edit>
std::string with_png_chunks(std::string bytes, Edit&& edit) {
  for (std::size_t at = 8; at + 12 <= bytes.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      length = length << 8 | static_cast<unsigned char>(bytes[at + i]);
    }
    if (length > bytes.size() - at - 12) break;
    edit(bytes, at, length);
    const auto* first = reinterpret_cast<const unsigned char*>(bytes.data()) + at + 4;
    const uLong sum = crc32(0, first, static_cast<uInt>(length + 4));
    bytes.replace(at + 8 + length, 4, big_endian(static_cast<std::uint32_t>(sum), 4));
    at += 12 + length;
  }
  return bytes;
}

inline std::string with_png_size(const std::string& bytes, std::uint32_t width,
                                 std::uint32_t height) {
  return with_png_chunks(bytes, [&](std::string& file, std::size_t at, std::size_t) {
    if (at == 8) file.replace(at + 8, 8, big_endian(width, 4) + big_endian(height, 4));
  });
}

/// Sets the size in the frame header (SOF0 or SOF2).
inline std::string with_jpeg_size(std::string bytes, std::uint32_t width, std::uint32_t height) {
  std::size_t at = bytes.find("\xFF\xC0");
  if (at == std::string::npos) at = bytes.find("\xFF\xC2");
  return bytes.replace(at + 5, 4, big_endian(height, 2) + big_endian(width, 2));
}

}  // namespace occ::test
