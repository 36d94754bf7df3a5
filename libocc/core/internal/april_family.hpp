// SPDX-License-Identifier: Apache-2.0
// Families of AprilTags in libapriltag, by name.
#pragma once

#include <memory>
#include <string>
#include <vector>

struct apriltag_family;  // of libapriltag

namespace occ::internal::core {

using AprilFamily = std::unique_ptr<apriltag_family, void (*)(apriltag_family*)>;

std::vector<std::string> april_family_names();

/// Null for an unknown name.
AprilFamily make_april_family(const std::string& name);

}  // namespace occ::internal::core
