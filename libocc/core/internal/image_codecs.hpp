// SPDX-License-Identifier: Apache-2.0
// Decoders and encoders of image files in memory, one source file per format.
//
// Errors are std::runtime_error with a text that continues "FILE: ". A decoder accepts any bytes:
// it neither crashes nor prints, and it allocates at most what a valid file of that length can
// need.
#pragma once

#include <csetjmp>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "libocc/core/image.hpp"

namespace occ::internal::core {

enum class ImageFormat { png, jpeg, tiff, pnm, other };

/// Detects the format from the first bytes of a file.
ImageFormat image_format(std::string_view bytes);

/// Error text for a file of format `other`: its probable format and what to do.
std::string unsupported_format(std::string_view bytes);

/// Colour is red, green, blue(, alpha); 8 and 16 bits per sample are kept.
Image decode_png(std::string_view bytes);
Image decode_jpeg(std::string_view bytes);
Image decode_tiff(std::string_view bytes);
Image decode_pnm(std::string_view bytes);

/// The view must be valid; the caller checks that the format stores its channels and depth.
std::vector<unsigned char> encode_png(const ImageView& image);
std::vector<unsigned char> encode_jpeg(const ImageView& image);
std::vector<unsigned char> encode_tiff(const ImageView& image);
std::vector<unsigned char> encode_pnm(const ImageView& image);

/// This machine's order of bytes; PNG and PNM store samples of 16 bits as big-endian.
constexpr bool little_endian = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;

/// 16384 x 16384 pixels: more than any camera's sensor, and at most 2 GiB (16 bits, 4 channels).
/// A larger size is taken as a forged or corrupt header.
constexpr std::uint64_t max_image_pixels = std::uint64_t{1} << 28;

/// Throws if the size is zero or above max_image_pixels.
void check_image_size(std::uint64_t width, std::uint64_t height);

/// Throws if `pixel_bytes` exceed the length of the file times `max_ratio`, the highest compression
/// ratio of its format. Prevents large allocations for short files with forged headers.
void check_file_length(std::uint64_t pixel_bytes, std::uint64_t file_bytes, unsigned max_ratio);

/// Allocates an image of zeros.
Image make_image(int width, int height, int channels, PixelType type);

std::size_t image_row_bytes(const ImageView& image);
std::size_t image_row_bytes(const Image& image);
unsigned char* image_row(Image& image, int y);
const unsigned char* image_row(const ImageView& image, int y);

/// Appends without throwing, for callbacks of C libraries; returns false if memory is exhausted.
bool append_bytes(std::vector<unsigned char>& out, const void* bytes, std::size_t count) noexcept;

/// Error state of a C library that reports errors by longjmp.
struct LibraryError {
  std::jmp_buf target;
  char text[200] = "";

  [[noreturn]] void leave(const char* reason) {
    std::snprintf(text, sizeof text, "%s", reason);
    std::longjmp(target, 1);
  }
};

/// Calls step(state), which may call state.leave(); that becomes std::runtime_error. longjmp skips
/// destructors, so `step` and the callbacks below it must not hold objects that have one.
template <class State>
void run_library(State& state, void (*step)(State&), const char* what) {
  if (setjmp(state.target) != 0) throw std::runtime_error(std::string(what) + ": " + state.text);
  step(state);
}

}  // namespace occ::internal::core
