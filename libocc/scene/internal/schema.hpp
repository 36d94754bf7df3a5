// SPDX-License-Identifier: Apache-2.0
// The first key of every file: `schema: libocc-scene/1`.
#pragma once

#include <string>

#include "libocc/scene/internal/yaml_section.hpp"

namespace occ::internal::scene {

/// Complains of a file that is not of this schema, or of a newer version of it.
void refuse_other_schema(YamlSection& root, const std::string& prefix, int newest);

}  // namespace occ::internal::scene
