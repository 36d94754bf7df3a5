// SPDX-License-Identifier: Apache-2.0
// Metrics of a closed-loop run, from its records.
#pragma once

#include "libocc/guide/closed_loop.hpp"

namespace occ::internal::guide {

LoopMetrics summarise(const LoopResult& result, const Route& route, const LoopOptions& options);

}  // namespace occ::internal::guide
