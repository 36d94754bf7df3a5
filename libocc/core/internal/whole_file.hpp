// SPDX-License-Identifier: Apache-2.0
// Image decoders fill in what a truncated file lacks and say nothing; this finds the end marker.
#pragma once

#include <string>

namespace occ::internal::core {

/// Why a PNG or JPEG file is not whole, or null when it is, or when it is neither.
const char* missing_end(const std::string& bytes);

}  // namespace occ::internal::core
