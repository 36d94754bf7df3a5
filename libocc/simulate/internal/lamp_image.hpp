// SPDX-License-Identifier: Apache-2.0
// The image of one lamp without noise, clipping or blinking: mean signal electrons of each pixel.
//
// An extended lamp's irradiance E varies over its image, so a pixel is the integral of E times the
// PSF over the shape. Expanded about the pixel, with c the coverage, (m_x, m_y) its first moments
// and s^2 the variance of PSF and pixel box together, it is
//     (E + s^2/2 laplacian E) c + grad E . (m_x, m_y) + ...
// What is left out changes with the second moment at the rim: 2e-6 to 1e-5 of the peak for focal
// lengths of 200 px and more and a PSF of 0.8 px, 1e-4 at worst for 2 px (measured).
#pragma once

#include <optional>

#include "libocc/formation/coverage.hpp"
#include "libocc/simulate/internal/frame.hpp"

namespace occ {

class LampRenderer {
 public:
  explicit LampRenderer(const Frame& frame);

  /// Empty (width 0) when no light of the lamp reaches the sensor; nothing when it cannot be
  /// rendered because part of its rim is outside the camera's domain or it shows its dark side.
  std::optional<Patch> render(const Lamp& lamp) const;

 private:
  std::optional<Patch> point_image(const Lamp& lamp, double share) const;
  Patch extended_image(const Contour& contour, const Lamp& lamp) const;
  void apply_light(const Lamp& lamp, const CoverageMoments& cover, Patch& image) const;

  const Frame& frame_;
  Camera camera_;  // without distortion when the plan leaves it out
  PixelPsf psf_;
  double spacing_px_;
};

}  // namespace occ
