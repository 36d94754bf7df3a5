// SPDX-License-Identifier: Apache-2.0
// Result for the user: status, message, poses with covariances, statistics.
#pragma once

#include "libocc/core/abi.hpp"
#include "libocc/core/status.hpp"
#include "libocc/smooth/internal/chain_search.hpp"

namespace occ::internal::smooth {

template <class Body>
Result<Smoothing<typename Body::Smoothed>> to_result(const ChainMinima<Body>& minima);

}  // namespace occ::internal::smooth
