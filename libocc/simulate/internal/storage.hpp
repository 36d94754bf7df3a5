// SPDX-License-Identifier: Apache-2.0
// What one image leaves to the next of the same scene: tables that take long to make, and memory.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "libocc/core/simd.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/formation/moment_filter.hpp"
#include "libocc/formation/pixel_psf.hpp"
#include "libocc/simulate/internal/irradiance_field.hpp"
#include "libocc/simulate/internal/room_surfaces.hpp"

namespace occ::internal::simulate {

/// A PSF, and how moments follow from coverage where pixels resolve it.
struct Blur {
  PixelPsf psf;
  std::optional<MomentFilter> moments;

  explicit Blur(double sigma_px) : psf(sigma_px) {
    if (MomentFilter::resolves(sigma_px)) moments.emplace(sigma_px);
  }
};

/// What a lamp's image is made in.
struct LampMemory {
  explicit LampMemory(Simd simd) : coverage(simd), field(simd) {}

  Contour contour;
  CoveragePainter coverage;
  IrradianceField field;
  PatchOf<float> light;
};

class Storage {
 public:
  explicit Storage(Simd simd) : lamp(simd), simd_(simd) {}

  Simd simd() const { return simd_; }

  LampMemory lamp;  ///< for one lamp at a time

  /// Made when it is first asked for; the reference stays valid.
  const Blur& blur(double sigma_px) { return blurs_.try_emplace(sigma_px, sigma_px).first->second; }

  /// The surfaces of the scene's room, lit; alike.
  const RoomSurfaces& room(const Scene& scene, const std::vector<double>& lamp_light,
                           bool interreflection) {
    const auto [at, is_new] = rooms_.try_emplace({lamp_light, interreflection}, scene, lamp_light);
    if (is_new && interreflection) at->second.solve_interreflection();
    return at->second;
  }

 private:
  Simd simd_;
  std::map<double, Blur> blurs_;
  std::map<std::pair<std::vector<double>, bool>, RoomSurfaces> rooms_;
};

}  // namespace occ::internal::simulate
