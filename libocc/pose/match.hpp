// SPDX-License-Identifier: Apache-2.0
// Which lamp of the scene is which blob of the image.
#pragma once

#include "libocc/core/abi.hpp"

namespace occ {

/// Assignment of one blob to one lamp.
struct Match {
  int lamp = 0;  ///< index into Scene::lamps (not the id)
  int blob = 0;  ///< index into the blobs
};

}  // namespace occ
