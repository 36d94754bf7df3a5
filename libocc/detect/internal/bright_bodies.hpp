// SPDX-License-Identifier: Apache-2.0
// Internal: bodies so large that most of the background's meshes around them see nothing but their
// light: a lamp close by. What is lit so far and smoothly (a wall, the glow around a lamp) is
// background; a body has a sharp outline, and nothing in it shines brighter than itself.
#pragma once

#include <vector>

#include "libocc/core/image.hpp"

namespace occ::internal::detect {

/// Background of an image on a coarse mesh, row after row.
struct Meshes {
  int size_px = 0;
  int columns = 0, rows = 0;
  std::vector<float> level, noise;  ///< [grey levels]

  std::size_t count() const { return level.size(); }
};

/// Meshes in and around bright bodies take level and noise from those beside them. What stands out
/// from the dark by little more than `min_noise_dn` is none.
void fill_bright_bodies(const ImageView& image, double min_noise_dn, Meshes& meshes);

}  // namespace occ::internal::detect
