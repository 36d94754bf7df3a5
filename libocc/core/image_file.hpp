// SPDX-License-Identifier: Apache-2.0
// Reads and writes image files: PNG, JPEG, TIFF, PGM and PPM.
//
// PNG: all kinds; palettes become colours, 1 to 4 bits per pixel become 8. JPEG: grey and colour of
// 8 bits. TIFF: grey, RGB and RGB with a fourth channel of 8 or 16 bits, in strips or tiles, not
// compressed or compressed by LZW or deflate; only the first image. PGM and PPM: text and binary.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/image.hpp"

namespace occ {

/// Reads an 8- or 16-bit image without scaling and without rotation by EXIF or TIFF tags; colour
/// channels are in the order red, green, blue, and alpha is the fourth channel. Throws
/// std::runtime_error with the file's name and the reason: missing, not an image, another format
/// (with its name), truncated, corrupt, more than 2^28 pixels, or a pixel type other than 8- or
/// 16-bit unsigned.
LIBOCC_API Image read_image(const std::string& path);

/// Encodes an image in the format of an extension: .png, .jpg, .jpeg (quality 95), .tif, .tiff,
/// .pgm (grey), .ppm (colour) or .pnm. Throws std::runtime_error if the format cannot store the
/// image.
LIBOCC_API std::vector<unsigned char> encode_image(const std::string& extension,
                                                   const ImageView& image);

/// Writes an image in the format of the file's extension. The write is atomic: a temporary file in
/// the same folder is renamed. Throws std::runtime_error with the file's name if it cannot be
/// written.
LIBOCC_API void write_image(const std::string& path, const ImageView& image);

}  // namespace occ
