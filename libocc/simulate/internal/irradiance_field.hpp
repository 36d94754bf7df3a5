// SPDX-License-Identifier: Apache-2.0
// Irradiance of an extended lamp at every pixel of a rectangle. It varies slowly (over the focal
// length, not over pixels), so it is evaluated on a coarse grid and interpolated by cubics.
#pragma once

#include <array>
#include <vector>

#include "libocc/formation/coverage.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::simulate {

/// Memory and weights are used again.
class IrradianceField {
 public:
  explicit IrradianceField(Simd simd) : simd_(simd) {}

  /// E [W/m^2] at the rectangle's pixels, and at some more right of it; values alone are missing
  /// from `field`. Pixels whose ray does not meet the lamp's lit side, or that lie outside the
  /// camera's domain, get the irradiance at the lamp's centre: only the tail of the PSF is there.
  void fill(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
            const Sensor& sensor, PatchOf<float>& field);

  static constexpr int max_step = 16;
  /// Weights of the pixels between two nodes, of the four nodes in turn.
  using Weights = std::array<std::array<float, max_step>, 4>;

 private:
  Simd simd_;
  int step_ = 0;                    // pixels from node to node
  std::array<Weights, 3> weights_;  // in the first, a middle and the last of three intervals
  std::vector<float> nodes_, lines_;
};

}  // namespace occ::internal::simulate
