// SPDX-License-Identifier: Apache-2.0
#include "libocc/scene/internal/schema.hpp"

#include <algorithm>
#include <charconv>

namespace occ::internal::scene {

void refuse_other_schema(YamlSection& root, const std::string& prefix, int newest) {
  std::string schema;
  root.need("schema", schema);
  int version = 0;
  const char* digits = schema.c_str() + std::min(prefix.size(), schema.size());
  const char* end = schema.c_str() + schema.size();
  const auto parsed = std::from_chars(digits, end, version);
  const bool is_schema = schema.compare(0, prefix.size(), prefix) == 0 &&
                         parsed.ec == std::errc() && parsed.ptr == end && version > 0;
  const std::string own = prefix + std::to_string(newest);
  if (!is_schema) root.fail_value("schema", "must be " + own);
  if (version > newest)
    root.fail_value("schema", "is newer than this library, which reads up to " + own);
}

}  // namespace occ::internal::scene
