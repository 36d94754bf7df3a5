// SPDX-License-Identifier: Apache-2.0
// What is true of one lamp in a rendered image.
#pragma once

#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/motion.hpp"

namespace occ::internal::simulate {

/// All but the electrons; of a lamp that cannot be rendered only the id and the centre. Under a
/// moving camera, where the middle of the exposure sees each point, of the line that sees it.
LampTruth lamp_truth(const Lamp& lamp, const Frame& frame, const Motion& motion,
                     const Camera& camera);

}  // namespace occ::internal::simulate
