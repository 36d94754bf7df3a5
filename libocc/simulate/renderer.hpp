// SPDX-License-Identifier: Apache-2.0
// Renders many images of one scene: thousands a second where noise is not wanted everywhere. What
// images have in common (tables of the PSF, of the response and of the noise, memory) is made once.
#pragma once

#include <memory>

#include "libocc/core/abi.hpp"
#include "libocc/core/simd.hpp"
#include "libocc/simulate/simulate.hpp"

namespace occ {

struct RendererOptions {
  /// Vector instructions to use: the same bits with all, at different speed. More than the
  /// processor has would crash.
  Simd simd = widest_simd();
};

/// For one thread at a time; an image does not depend on those rendered before.
class LIBOCC_API Renderer {
 public:
  /// Keeps a copy of the scene. Throws std::invalid_argument when it does not validate.
  explicit Renderer(const Scene& scene, const RendererOptions& options = {});
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  /// As simulate() does, into `out`: a new one, or one that a Renderer filled before, whose pixels
  /// are as it left them. Then only the pixels that may change are written.
  void render(const Rigid3& cam_from_world, const SimulateOptions& options, Rendered& out);

 private:
  class Workshop;
  std::unique_ptr<Workshop> workshop_;
};

}  // namespace occ
