// SPDX-License-Identifier: Apache-2.0
// What is true of one lamp in a rendered image.
#pragma once

#include "libocc/simulate/simulate.hpp"

namespace occ {

/// All but the electrons; of a lamp that cannot be rendered only the id and the centre.
LampTruth lamp_truth(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera);

}  // namespace occ
