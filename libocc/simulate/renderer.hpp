// SPDX-License-Identifier: Apache-2.0
// Renders many images of one scene, thousands per second if only the lamps have noise
// (NoiseArea::around_lamps). Tables of the PSF, the response and the noise, and memory are shared
// by all images.
#pragma once

#include <memory>

#include "libocc/core/abi.hpp"
#include "libocc/core/simd.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ {

/// Options of a Renderer.
struct RendererOptions {
  /// Vector instructions to use. All give the same bits at different speed. A set that the
  /// processor does not have crashes the program.
  Simd simd = widest_simd();
};

/// Renders images of a scene. Use one Renderer per thread. An image does not depend on the images
/// rendered before.
class LIBOCC_API Renderer {
 public:
  /// Copies the scene. Throws std::invalid_argument if it does not validate.
  explicit Renderer(const Scene& scene, const RendererOptions& options = {});
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  /// Renders the image that simulate() returns into `out`, which is new or was filled by a Renderer
  /// before and not changed since; then only the pixels that may change are written.
  void render(const Rigid3& cam_from_world, const SimulateOptions& options, Rendered& out);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace occ
