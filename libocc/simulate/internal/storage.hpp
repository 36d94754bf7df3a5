// SPDX-License-Identifier: Apache-2.0
// What one image leaves to the next of the same scene: tables that take long to make, and memory.
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "libocc/core/simd.hpp"
#include "libocc/formation/pixel_psf.hpp"
#include "libocc/simulate/internal/room_surfaces.hpp"

namespace occ {

class Storage {
 public:
  explicit Storage(Simd simd) : simd_(simd) {}

  Simd simd() const { return simd_; }

  /// Made when it is first asked for; the reference stays valid.
  const PixelPsf& psf(double sigma_px) {
    return psfs_.try_emplace(sigma_px, sigma_px).first->second;
  }

  /// The surfaces of the scene's room, lit; alike.
  const RoomSurfaces& room(const Scene& scene, const std::vector<double>& lamp_light,
                           bool interreflection) {
    const auto [at, is_new] = rooms_.try_emplace({lamp_light, interreflection}, scene, lamp_light);
    if (is_new && interreflection) at->second.solve_interreflection();
    return at->second;
  }

 private:
  Simd simd_;
  std::map<double, PixelPsf> psfs_;
  std::map<std::pair<std::vector<double>, bool>, RoomSurfaces> rooms_;
};

}  // namespace occ
