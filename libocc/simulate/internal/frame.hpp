// SPDX-License-Identifier: Apache-2.0
// Input of one rendered image, and the tables and buffers that images of one scene share.
#pragma once

#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "libocc/core/simd.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/formation/moment_filter.hpp"
#include "libocc/formation/pixel_psf.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"
#include "libocc/simulate/internal/irradiance_field.hpp"
#include "libocc/simulate/internal/room_surfaces.hpp"
#include "libocc/simulate/plan.hpp"

namespace occ::internal::simulate {

/// A PSF, and the filter that computes moments from coverage where pixels resolve the PSF.
struct Blur {
  PixelPsf psf;
  std::optional<MomentFilter> moments;

  explicit Blur(double sigma_px) : psf(sigma_px) {
    if (MomentFilter::resolves(sigma_px)) moments.emplace(sigma_px);
  }
};

/// Buffers for the image of one lamp.
struct LampMemory {
  explicit LampMemory(Simd simd) : coverage(simd), field(simd) {}

  Contour contour;
  CoveragePainter coverage;
  IrradianceField field;
  PatchOf<float> light;
};

/// Tables and buffers kept from image to image of one scene.
class Storage {
 public:
  explicit Storage(Simd simd) : lamp(simd), simd_(simd) {}

  Simd simd() const { return simd_; }

  LampMemory lamp;  ///< for one lamp at a time

  /// Computed at the first call for this sigma; the reference stays valid.
  const Blur& blur(double sigma_px) { return blurs_.try_emplace(sigma_px, sigma_px).first->second; }

  /// Lit surfaces of the scene's room. Computed at the first call for these arguments; the
  /// reference stays valid.
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

struct Frame {
  const Scene& scene;
  const Rigid3& cam_from_world;
  const SimulateOptions& options;
  const RenderPlan& plan;
  Storage& storage;
};

/// The camera of the image: without distortion when the plan leaves distortion out.
inline Camera rendered_camera(const Frame& frame) {
  const Camera& camera = frame.scene.camera;
  return frame.plan.applies(Effect::distortion) ? camera : camera.without_distortion();
}

}  // namespace occ::internal::simulate
