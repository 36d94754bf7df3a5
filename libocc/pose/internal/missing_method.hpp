// SPDX-License-Identifier: Apache-2.0
// Error for methods that were left out of a build (CMake options LIBOCC_OPENCV, LIBOCC_OPENGV).
#pragma once

#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/pose/solver.hpp"

namespace occ::internal::pose {

/// Throws std::invalid_argument that names the CMake option if `name` is one of `missing`.
void require_in_build(const std::string& argument, const std::string& name,
                      const std::vector<MissingMethod>& missing);

/// Returns true if a solver is in solvers().
bool is_in_build(const std::string& solver);

}  // namespace occ::internal::pose
