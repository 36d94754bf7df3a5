// SPDX-License-Identifier: Apache-2.0
// JPEG files with libjpeg-turbo. Functions that its errors leave by longjmp hold plain data only.
#include <cstdio>  // jpeglib.h needs it
// clang-format off
#include <jpeglib.h>
#include <jerror.h>
// clang-format on

#include <array>

#include "libocc/core/internal/image_codecs.hpp"

namespace occ::internal::core {

namespace {

/// OpenCV's default, which earlier versions of libocc used.
constexpr int written_quality = 95;

/// Cameras and encoders write about 10 scans. Files with thousands of scans take minutes to decode.
constexpr int max_scans = 200;

/// A Huffman code has at least 1 bit, and an image one code per block of 8 x 8 pixels.
constexpr unsigned max_pixels_per_byte = 8 * 64;

struct JpegReader : LibraryError {
  JpegReader() = default;
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;
  ~JpegReader() { jpeg_destroy_decompress(&info); }

  jpeg_decompress_struct info{};
  jpeg_error_mgr manager{};
  jpeg_progress_mgr progress{};
  std::string_view bytes;
  unsigned char* pixels = nullptr;
  std::size_t row_bytes = 0;
};

struct JpegWriter : LibraryError {
  explicit JpegWriter(const ImageView& pixels) : image(pixels) {}
  JpegWriter(const JpegWriter&) = delete;
  JpegWriter& operator=(const JpegWriter&) = delete;
  ~JpegWriter() { jpeg_destroy_compress(&info); }

  const ImageView& image;
  jpeg_compress_struct info{};
  jpeg_error_mgr manager{};
  jpeg_destination_mgr destination{};
  std::array<unsigned char, 1 << 16> block;
  std::vector<unsigned char> bytes;
};

[[noreturn]] void on_error(j_common_ptr info) {
  char reason[JMSG_LENGTH_MAX];
  info->err->format_message(info, reason);
  static_cast<LibraryError*>(info->client_data)->leave(reason);
}

/// Level -1 is a warning, and all but one report corrupt data; levels from 0 trace the decoder.
void on_message(j_common_ptr info, int level) {
  if (level < 0 && info->err->msg_code != JWRN_JFIF_MAJOR) on_error(info);
}

void on_progress(j_common_ptr info) {
  if (reinterpret_cast<j_decompress_ptr>(info)->input_scan_number <= max_scans) return;
  static_cast<LibraryError*>(info->client_data)->leave("more than 200 scans");
}

jpeg_error_mgr* set_handlers(jpeg_error_mgr& manager) {
  jpeg_std_error(&manager);
  manager.error_exit = on_error;
  manager.emit_message = on_message;
  return &manager;
}

void read_header(JpegReader& reader) {
  reader.info.err = set_handlers(reader.manager);
  reader.info.client_data = static_cast<LibraryError*>(&reader);
  jpeg_create_decompress(&reader.info);
  reader.progress.progress_monitor = on_progress;
  reader.info.progress = &reader.progress;
  jpeg_mem_src(&reader.info, reinterpret_cast<const unsigned char*>(reader.bytes.data()),
               static_cast<unsigned long>(reader.bytes.size()));
  jpeg_read_header(&reader.info, TRUE);
}

void read_pixels(JpegReader& reader) {
  jpeg_decompress_struct& info = reader.info;
  info.out_color_space = info.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_start_decompress(&info);
  while (info.output_scanline < info.output_height) {
    JSAMPROW row = reader.pixels + std::size_t{info.output_scanline} * reader.row_bytes;
    jpeg_read_scanlines(&info, &row, 1);
  }
  jpeg_finish_decompress(&info);
}

/// Refuses kinds by the header; the library itself refuses other processes, e.g. lossless JPEG.
void check_kind(const JpegReader& reader) {
  const jpeg_decompress_struct& info = reader.info;
  check_image_size(info.image_width, info.image_height);
  if (info.num_components == 4) {
    throw std::runtime_error("is a JPEG picture with the colours CMYK; convert it to RGB");
  }
  if (info.num_components != 1 && info.num_components != 3) {
    throw std::runtime_error("has " + std::to_string(info.num_components) +
                             " channels; 1 or 3 are read from JPEG");
  }
  if (info.data_precision != 8) {
    throw std::runtime_error("is a JPEG picture with " + std::to_string(info.data_precision) +
                             " bits per sample; convert it to a 16-bit PNG");
  }
  if (info.arith_code) {
    throw std::runtime_error("is a JPEG picture with arithmetic coding; convert it to PNG");
  }
  check_file_length(std::uint64_t{info.image_width} * info.image_height, reader.bytes.size(),
                    max_pixels_per_byte);
}

JpegWriter& writer_of(j_compress_ptr info) {
  return *static_cast<JpegWriter*>(static_cast<LibraryError*>(info->client_data));
}

void start_block(j_compress_ptr info) {
  JpegWriter& writer = writer_of(info);
  writer.destination.next_output_byte = writer.block.data();
  writer.destination.free_in_buffer = writer.block.size();
}

boolean end_block(j_compress_ptr info) {
  JpegWriter& writer = writer_of(info);
  if (!append_bytes(writer.bytes, writer.block.data(), writer.block.size())) {
    writer.leave("out of memory");
  }
  start_block(info);
  return TRUE;
}

void end_file(j_compress_ptr info) {
  JpegWriter& writer = writer_of(info);
  const std::size_t used = writer.block.size() - writer.destination.free_in_buffer;
  if (!append_bytes(writer.bytes, writer.block.data(), used)) writer.leave("out of memory");
}

void write_jpeg(JpegWriter& writer) {
  jpeg_compress_struct& info = writer.info;
  info.err = set_handlers(writer.manager);
  info.client_data = static_cast<LibraryError*>(&writer);
  jpeg_create_compress(&info);
  writer.destination.init_destination = start_block;
  writer.destination.empty_output_buffer = end_block;
  writer.destination.term_destination = end_file;
  info.dest = &writer.destination;
  info.image_width = static_cast<JDIMENSION>(writer.image.width);
  info.image_height = static_cast<JDIMENSION>(writer.image.height);
  info.input_components = writer.image.channels;
  info.in_color_space = writer.image.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, written_quality, TRUE);
  jpeg_start_compress(&info, TRUE);
  for (int y = 0; y < writer.image.height; ++y) {
    JSAMPROW row = const_cast<JSAMPROW>(image_row(writer.image, y));  // only read from
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
}

}  // namespace

Image decode_jpeg(std::string_view bytes) {
  constexpr const char* what = "cannot be decoded as JPEG";
  JpegReader reader;
  reader.bytes = bytes;
  run_library(reader, read_header, what);
  check_kind(reader);
  Image image = make_image(static_cast<int>(reader.info.image_width),
                           static_cast<int>(reader.info.image_height), reader.info.num_components,
                           PixelType::u8);
  reader.pixels = image_row(image, 0);
  reader.row_bytes = image_row_bytes(image);
  run_library(reader, read_pixels, what);
  return image;
}

std::vector<unsigned char> encode_jpeg(const ImageView& image) {
  JpegWriter writer(image);
  run_library(writer, write_jpeg, "cannot be encoded as JPEG");
  return std::move(writer.bytes);
}

}  // namespace occ::internal::core
