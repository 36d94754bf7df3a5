// SPDX-License-Identifier: Apache-2.0
// Checks of a network before its adjustment, the number of observations, and names of unknowns.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/status.hpp"
#include "libocc/network/internal/network_layout.hpp"

namespace occ::internal::network {

struct CheckOutcome {
  Status status = Status::ok;
  std::string message;
};

/// too_few_lamps: a station or the network observes too few targets; degenerate: groups of stations
/// that share no target.
CheckOutcome check_solvable(const Network& network, const NetworkLayout& layout);

/// Names of the owners of some reduced unknowns, each once: "fx of camera a", "station b", "point
/// 7".
std::string names_of_unknowns(const Network& network, const NetworkLayout& layout,
                              const std::vector<Index>& reduced);

/// Number of used scalar observations: two for an image point, six for a pose prior.
int count_observations(const Network& network, const NetworkLayout& layout);

}  // namespace occ::internal::network
