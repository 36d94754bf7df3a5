// SPDX-License-Identifier: Apache-2.0
// Reads and writes image files (PNG, JPEG, PGM, TIFF and other formats of OpenCV).
#pragma once

#include <string>
#include <vector>

#include "libocc/core/image.hpp"

namespace occ {

/// Reads an 8- or 16-bit image without scaling and without rotation by EXIF; colour channels are in
/// the order blue, green, red. Throws std::runtime_error with the file's name and the reason:
/// missing, not an image, truncated (a PNG without its end chunk, a JPEG without its end marker),
/// or a pixel type other than 8- or 16-bit unsigned.
LIBOCC_API Image read_image(const std::string& path);

/// Encodes an image in the format of an extension such as ".png". Throws std::runtime_error if the
/// format cannot store the image.
LIBOCC_API std::vector<unsigned char> encode_image(const std::string& extension,
                                                   const ImageView& image);

/// Writes an image in the format of the file's extension. The write is atomic: a temporary file in
/// the same folder is renamed. Throws std::runtime_error with the file's name if it cannot be
/// written.
LIBOCC_API void write_image(const std::string& path, const ImageView& image);

}  // namespace occ
