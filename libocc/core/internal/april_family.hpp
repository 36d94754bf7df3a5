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

/// Names of the families whose tags have a black border, which may be wider than one cell.
std::vector<std::string> bordered_family_names();

/// The family with a black border of `border_cells`, 1 or more; wider ones are for the families of
/// bordered_family_names() only. Null for an unknown name.
AprilFamily make_april_family(const std::string& name, int border_cells = 1);

/// Number of tags of a family; 0 for an unknown name.
int april_family_size(const std::string& name);

/// Side of the black square of a family of bordered_family_names() [cells].
int april_family_width(const std::string& name, int border_cells);

}  // namespace occ::internal::core
