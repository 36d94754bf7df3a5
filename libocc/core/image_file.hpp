// SPDX-License-Identifier: Apache-2.0
// Image files (PNG, JPEG, PGM, TIFF and what else OpenCV reads) to and from occ::Image.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/image.hpp"

namespace occ {

/// Reads an 8- or 16-bit image as it is stored: no scaling, no rotation by EXIF; colour channels
/// stay (blue, green, red). Throws std::runtime_error naming the file and the reason: absent, not
/// an image, truncated (a PNG without its end chunk, a JPEG without its end marker), a pixel type
/// other than 8- or 16-bit unsigned.
LIBOCC_API Image read_image(const std::string& path);

/// Bytes of a file of the format that the extension (".png") names. Throws std::runtime_error
/// naming it when it cannot hold the image.
LIBOCC_API std::vector<unsigned char> encode_image(const std::string& extension,
                                                   const ImageView& image);

/// Writes by the name's extension, whole or not at all (a temporary file beside it is renamed).
/// Throws std::runtime_error naming the file when it cannot be written.
LIBOCC_API void write_image(const std::string& path, const ImageView& image);

}  // namespace occ
