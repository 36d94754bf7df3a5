// SPDX-License-Identifier: Apache-2.0
// The image of one lamp without noise or clipping: mean signal electrons of each pixel. Blinking is
// in it when the camera moves meanwhile (internal/motion.hpp), else lit_fractions applies it.
//
// An extended lamp's irradiance E varies over its image, so a pixel is the integral of E times the
// PSF over the shape. Expanded about the pixel, with c the coverage, (m_x, m_y) its first moments
// and s^2 the variance of PSF and pixel box together, it is
//     (E + s^2/2 laplacian E) c + grad E . (m_x, m_y) + ...
// Moments follow from c where pixels resolve the PSF (formation/moment_filter.hpp).
// What is left out changes with the second moment at the rim: 2e-6 to 1e-5 of the peak for focal
// lengths of 200 px and more and a PSF of 0.8 px, 1e-4 at worst for 2 px (measured).
//
// Defocus and motion blur are sums of such images, shifted and seen from several poses: contours
// are put together with weights. Light that a shift s brings to a pixel has left for p - s, so that
// its weight is that of the shift times 1 - s . grad ln E.
#pragma once

#include <optional>

#include "libocc/formation/coverage.hpp"
#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/line_image.hpp"
#include "libocc/simulate/internal/lit_rows.hpp"
#include "libocc/simulate/internal/motion.hpp"
#include "libocc/simulate/internal/occlusion.hpp"
#include "libocc/simulate/internal/vignetting.hpp"

namespace occ::internal::simulate {

class LampRenderer {
 public:
  explicit LampRenderer(const Frame& frame) : LampRenderer(frame, rendered_camera(frame)) {}
  LampRenderer(const Frame& frame, const Camera& camera);

  /// Empty (width 0) when no light of the lamp reaches the sensor; false when it cannot be rendered
  /// because part of its rim is outside the camera's domain or it shows its dark side. The image's
  /// storage is used again.
  bool render(const Lamp& lamp, PaddedPatch& image) const;

  /// That of the image: without distortion when the plan leaves it out.
  const Camera& camera() const { return camera_; }
  const Motion& motion() const { return motion_; }

 private:
  // A lamp taken for a point, and the face of which a part may be hidden.
  std::optional<Patch> point_image(const Lamp& lamp, const Lamp& face) const;
  std::optional<Patch> point_by_lines(const Lamp& lamp, const Lamp& face) const;
  bool extended_image(const Lamp& lamp, PaddedPatch& image) const;
  bool sharp_image(const Lamp& lamp, const std::vector<LightNode>& nodes, PaddedPatch& image) const;
  std::optional<Patch> extended_by_lines(const Lamp& lamp) const;
  LineImageInput line_input(const Lamp& lamp) const;
  Rigid3 seen_pose(const Lamp& lamp) const;

  bool is_point(const Lamp& lamp) const;
  bool may_be_hidden() const { return frame_.plan.applies(Effect::occlusion); }
  formation::Visible visible(const Lamp& lamp, const Rigid3& pose) const;

  std::vector<LightNode> nodes(const Lamp& lamp) const;
  std::vector<formation::BlurShift> shifts(const Lamp& lamp, const Rigid3& pose) const;
  double point_electrons(const Lamp& lamp, const Rigid3& pose, const Eigen::Vector2d& px) const;
  double light_change(const Lamp& lamp, const Rigid3& reference, const Rigid3& pose) const;
  Eigen::Vector2d log_light_gradient(const Lamp& lamp, const Rigid3& pose) const;
  double panels_per_px() const;

  std::optional<RimContour> rim(const Lamp& lamp, const Rigid3& pose) const;
  bool contour(const Lamp& lamp, const std::vector<LightNode>& nodes,
               const std::vector<formation::BlurShift>& shifts, Contour& contour) const;
  std::optional<CoverageMoments> sharp_moments(const Lamp& lamp,
                                               const std::vector<LightNode>& nodes) const;
  double centre_irradiance(const Lamp& lamp, const Rigid3& pose) const;
  bool is_evenly_lit() const;
  double even_electrons(const Lamp& lamp, const Rigid3& pose) const;
  const PatchOf<float>& light_around(const Lamp& lamp, const Rigid3& pose, int x0, int y0,
                                     int width, int height) const;
  template <typename AnyPatch, typename Visit>
  void for_lit_rows(const Lamp& lamp, const Rigid3& pose, const AnyPatch& image, Visit visit) const;
  Patch with_even_light(const Lamp& lamp, const Rigid3& pose, Patch image) const;
  Patch with_light(const Lamp& lamp, const Rigid3& pose, CoverageMoments cover) const;

  const Frame& frame_;
  Camera camera_;
  Motion motion_;
  std::optional<scene::Vignetting> vignetting_;
  const Blur* blur_ = nullptr;     // none: sharp
  const PixelPsf* psf_ = nullptr;  // that of the blur
  double spacing_px_ = 1;
};

}  // namespace occ::internal::simulate
