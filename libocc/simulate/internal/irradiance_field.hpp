// SPDX-License-Identifier: Apache-2.0
// Irradiance of an extended lamp at each pixel of a rectangle. It varies on the scale of the focal
// length, so it is evaluated on a coarse grid and interpolated by cubics.
#pragma once

#include <array>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::simulate {

/// Keeps its buffers and weights from call to call.
class LIBOCC_API IrradianceField {
 public:
  explicit IrradianceField(Simd simd) : simd_(simd) {}

  /// Fills the values of `field`, whose rectangle is given, with E [W/m^2]; may extend it to the
  /// right. Pixels whose ray does not meet the lamp's lit side, or that are outside the camera's
  /// domain, receive the irradiance at the lamp's centre; only the tail of the PSF reaches them.
  void fill(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
            const Sensor& sensor, PatchOf<float>& field);

  static constexpr int max_step = 16;
  /// Weights of the four nodes for each pixel between two nodes.
  using Weights = std::array<std::array<float, max_step>, 4>;

 private:
  Simd simd_;
  int step_ = 0;                    // distance of the nodes [px]
  std::array<Weights, 3> weights_;  // for the first, middle and last of three intervals
  std::vector<float> nodes_, lines_;
};

}  // namespace occ::internal::simulate
