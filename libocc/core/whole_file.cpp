// SPDX-License-Identifier: Apache-2.0
#include "libocc/core/internal/whole_file.hpp"

#include <cstdint>

namespace occ::internal::core {

namespace {

unsigned byte_at(const std::string& bytes, std::size_t i) {
  return static_cast<unsigned char>(bytes[i]);
}

/// Walks the chunks (length, type, data, check sum) up to IEND.
bool png_ends(const std::string& bytes) {
  std::size_t at = 8;
  while (at + 12 <= bytes.size()) {
    std::uint64_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | byte_at(bytes, at + i);
    if (length > bytes.size() - at - 12) return false;
    if (bytes.compare(at + 4, 4, "IEND") == 0) return true;
    at += static_cast<std::size_t>(length) + 12;
  }
  return false;
}

/// Walks the segments up to the end marker. Searching for its two bytes would not do: a thumbnail
/// inside the header ends with them too.
bool jpeg_ends(const std::string& bytes) {
  std::size_t at = 2;
  while (at + 1 < bytes.size()) {
    const unsigned marker = byte_at(bytes, at + 1);
    const bool is_marker = byte_at(bytes, at) == 0xFF && marker != 0 && marker != 0xFF;
    const bool stands_alone = marker == 0x01 || (marker >= 0xD0 && marker <= 0xD7);
    if (!is_marker || stands_alone) {  // entropy-coded data, padding, restart markers
      ++at;
      continue;
    }
    if (marker == 0xD9) return true;
    if (at + 3 >= bytes.size()) return false;
    at += 2 + (byte_at(bytes, at + 2) << 8 | byte_at(bytes, at + 3));
  }
  return false;
}

}  // namespace

const char* missing_end(const std::string& bytes) {
  static const std::string png("\x89PNG\r\n\x1a\n", 8), jpeg("\xFF\xD8\xFF", 3);
  if (bytes.compare(0, png.size(), png) == 0 && !png_ends(bytes)) {
    return "is truncated: a PNG file without its end chunk";
  }
  if (bytes.compare(0, jpeg.size(), jpeg) == 0 && !jpeg_ends(bytes)) {
    return "is truncated: a JPEG file without its end marker";
  }
  return nullptr;
}

}  // namespace occ::internal::core
