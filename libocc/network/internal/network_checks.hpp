// SPDX-License-Identifier: Apache-2.0
// What can be said against a network before it is adjusted, and the names of its unknowns.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/status.hpp"
#include "libocc/network/internal/network_layout.hpp"

namespace occ::internal::network {

struct Objection {
  Status status = Status::ok;
  std::string message;
};

/// Too few targets, images that share none with the rest; ok when there is nothing to say.
Objection objection_to(const Network& network, const NetworkLayout& layout);

/// "fx of camera a", "the pose of station b", "point 7": the unknowns' owners, each once.
std::string names_of_unknowns(const Network& network, const NetworkLayout& layout,
                              const std::vector<Index>& reduced);

/// Rows of all observations that are used: two for an image point, six for a pose prior.
int count_observations(const Network& network, const NetworkLayout& layout);

}  // namespace occ::internal::network
