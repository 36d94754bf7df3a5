// SPDX-License-Identifier: Apache-2.0
// Simulated noise for networks: one trial of a Monte Carlo experiment.
#pragma once

#include <cstdint>

#include "libocc/core/abi.hpp"
#include "libocc/network/network.hpp"

namespace occ::internal::network {

/// Network with normally distributed noise on pixels and distances, by their sigmas. Points,
/// stations and bodies that are not fixed start with errors of `start_error_m` and 0.2 rad/m of it.
/// `truth`: exact positions; the same seed gives the same bits. Throws std::invalid_argument for a
/// negative start error.
LIBOCC_API Network noisy_network(const Network& truth, std::uint64_t seed, double start_error_m);

}  // namespace occ::internal::network
