// SPDX-License-Identifier: Apache-2.0
// Names in a message.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <vector>

namespace occ::internal::core {

/// The first `max_names` names, such as "a, b and 3 more".
inline std::string name_list(const std::vector<std::string>& names, std::size_t max_names) {
  std::string text;
  for (std::size_t i = 0; i < std::min(names.size(), max_names); ++i)
    text += (i == 0 ? "" : ", ") + names[i];
  if (names.size() > max_names)
    text += " and " + std::to_string(names.size() - max_names) + " more";
  return text;
}

}  // namespace occ::internal::core
