// SPDX-License-Identifier: Apache-2.0
// Colour images of the library's renderer: one image for each channel, with independent noise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "libocc/core/image.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ::test {

/// RGB image of a scene. The power of each lamp is multiplied by its colour; ambient light and
/// walls are white.
inline Rendered simulate_colours(const Scene& scene, const Rigid3& cam_from_world,
                                 const SimulateOptions& options = {}) {
  Rendered out;
  for (std::size_t k = 0; k < 3; ++k) {
    Scene channel = scene;
    for (Lamp& lamp : channel.lamps) {
      lamp.power_w *= lamp.colour[static_cast<Eigen::Index>(k)] + 1e-9;  // positive
      lamp.colour.setOnes();
    }
    SimulateOptions of_channel = options;
    of_channel.seed = 3 * options.seed + k;
    Rendered rendered = simulate(channel, cam_from_world, of_channel);
    if (k == 0) {
      out = rendered;
      out.image.channels = 3;
      out.image.u8.resize(3 * rendered.image.u8.size());
      out.image.u16.resize(3 * rendered.image.u16.size());
    }
    for (std::size_t i = 0; i < rendered.image.u8.size(); ++i)
      out.image.u8[3 * i + k] = rendered.image.u8[i];
    for (std::size_t i = 0; i < rendered.image.u16.size(); ++i)
      out.image.u16[3 * i + k] = rendered.image.u16[i];
  }
  return out;
}

}  // namespace occ::test
