// SPDX-License-Identifier: Apache-2.0
// Detects truncated image files, which image decoders accept without an error.
#pragma once

#include <string>

namespace occ::internal::core {

/// Reason why a PNG or JPEG file is incomplete; null for a complete file and for other formats.
const char* missing_end(const std::string& bytes);

}  // namespace occ::internal::core
