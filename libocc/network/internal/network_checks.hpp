// SPDX-License-Identifier: Apache-2.0
// Checks of a network before its adjustment, the number of observations, and names of unknowns.
#pragma once

#include <string>
#include <vector>

#include "libocc/core/status.hpp"
#include "libocc/network/internal/network_layout.hpp"

namespace occ::internal::network {

/// "station s2", or "station 2" without a name.
template <typename Item>
std::string name_or(const Item& item, const char* kind, std::size_t index) {
  return std::string(kind) + " " + (item.name.empty() ? std::to_string(index) : item.name);
}

struct CheckOutcome {
  Status status = Status::ok;
  std::string message;
};

/// A station that is not fixed, has no prior, and observes too few determined targets for its pose.
struct WeakStation {
  int station = 0, targets = 0;
};
std::vector<WeakStation> weak_stations(const Network& network, const NetworkLayout& layout);

/// Stations without a prior whose observations hardly determine their pose, as on the danger
/// cylinder of three targets, or for targets on one line: one standard deviation away, residuals
/// differ noticeably from linear ones, so that another pose may fit as well. Tested are those with
/// three targets, and those that own one of the `suspects` (reduced unknowns). A station with
/// outlines is not tested. Targets, cameras and mounts are held.
std::vector<WeakStation> undetermined_stations(const Network& network, const NetworkLayout& layout,
                                               const std::vector<Index>& suspects);

/// Number of stations that observe a determined target.
std::size_t count_observing_stations(const Network& network, const NetworkLayout& layout);

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
