// SPDX-License-Identifier: Apache-2.0
// Which lamp of the scene is which blob of the image.
#pragma once

#include "libocc/core/abi.hpp"

namespace occ {

struct Match {
  int lamp = 0;  ///< index into Scene::lamps (not the id)
  int blob = 0;  ///< index into the blobs
};

}  // namespace occ
