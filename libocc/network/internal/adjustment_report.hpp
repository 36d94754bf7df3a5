// SPDX-License-Identifier: Apache-2.0
// Lists and sentences about what an adjustment rejected and left out, and what to check.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "libocc/core/status.hpp"
#include "libocc/network/adjust.hpp"
#include "libocc/network/internal/network_layout.hpp"

namespace occ::internal::network {

/// Reasons (clauses) by kind and index of what was left out.
using LeftOutReasons = std::map<std::pair<LeftOut::Kind, int>, std::string>;

/// "distance 3 (point 1 to point 7, 2 m)".
std::string name_of_distance(const Network& network, int distance);
/// "control point 3 (tag 7.2)".
std::string name_of_control(const Network& network, int control);
/// Sentence about distances or control points (names) of which one must be wrong.
std::string contradiction_of(const std::vector<std::string>& names);

/// Fills the lists, warnings and the message of a finished adjustment; gives what was left out its
/// start values. `given`: the network before the adjustment; `layout`: of the result;
/// `contradiction`: a sentence about observations of which one must be wrong, or empty.
void report(const Network& given, const NetworkLayout& layout, const LeftOutReasons& reasons,
            const std::string& contradiction, Result<Adjustment>& result);

}  // namespace occ::internal::network
