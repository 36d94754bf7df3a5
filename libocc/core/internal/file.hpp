// SPDX-License-Identifier: Apache-2.0
// Reads and writes complete files; messages contain the path.
#pragma once

#include <string>

namespace occ::internal::core {

/// All bytes of a file. Throws std::runtime_error "PATH: cannot be read: REASON".
std::string read_file(const std::string& path);

/// Writes atomically: a synchronised temporary file in the same folder is renamed to `path`. Throws
/// std::runtime_error "PATH: cannot be written: REASON".
void write_file(const std::string& path, const void* bytes, std::size_t count);

}  // namespace occ::internal::core
