// SPDX-License-Identifier: Apache-2.0
// Renders the image of one lamp without noise or clipping: mean signal electrons of each pixel. The
// image includes the lamp's blinking if the camera moves during the exposure (Motion::Kind);
// otherwise add_lamp applies lit_fractions.
//
// The irradiance E of an extended lamp varies over its image. A pixel is the integral of E times
// the PSF over the shape. Expanded about the pixel, with the coverage c, its first moments (m_x,
// m_y) and the variance s^2 of PSF and pixel box together, the integral is
//     (E + s^2/2 laplacian E) c + grad E . (m_x, m_y) + ...
// The moments follow from c where pixels resolve the PSF (formation/moment_filter.hpp). The omitted
// terms vary with the second moment at the rim: 2e-6 to 1e-5 of the peak for focal lengths of 200
// px and more and a PSF of 0.8 px, and at most 1e-4 for 2 px (measured).
//
// Defocus and motion blur are sums of such images, shifted and seen from several poses; their
// contours are combined with weights. Light that a shift s brings to a pixel p comes from p - s, so
// its weight is the weight of the shift times 1 - s . grad ln E.
#pragma once

#include <optional>

#include "libocc/formation/contour.hpp"
#include "libocc/formation/coverage.hpp"
#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/formation/internal/shadow.hpp"
#include "libocc/formation/internal/sharp_coverage.hpp"
#include "libocc/scene/internal/vignetting.hpp"
#include "libocc/simulate/internal/frame.hpp"
#include "libocc/simulate/internal/line_image.hpp"
#include "libocc/simulate/internal/lit_rows.hpp"
#include "libocc/simulate/internal/motion.hpp"
#include "libocc/simulate/internal/signal.hpp"

namespace occ::internal::simulate {

/// Rim of the visible part of a lamp's face, and the chords of its image, in the camera's frame.
/// Empty optional under the same conditions as rim_contour and project_chords. Defined in
/// effects/occlusion.cpp.
std::optional<RimContour> visible_rim(const Lamp& lamp, const formation::Visible& visible,
                                      const Rigid3& cam_from_world, const Camera& camera,
                                      double spacing_px);
std::optional<formation::Chords> visible_chords(const Lamp& lamp, const formation::Visible& visible,
                                                const Rigid3& cam_from_world, const Camera& camera);

/// Adds a lamp's image to the signal, with the lamp's blinking for each line and the colour filter
/// of each pixel. Returns the electrons added.
double add_lamp(const PaddedPatch& image, const Lamp& lamp, const Frame& frame, Signal& signal);

/// Truth of one lamp, except for its electrons. Only the id and the centre are set for a lamp that
/// cannot be rendered. Under a moving camera, each point is projected in the middle of the exposure
/// of the line that records it.
LampTruth lamp_truth(const Lamp& lamp, const Frame& frame, const Motion& motion,
                     const Camera& camera);

class LampRenderer {
 public:
  explicit LampRenderer(const Frame& frame) : LampRenderer(frame, rendered_camera(frame)) {}
  LampRenderer(const Frame& frame, const Camera& camera);

  /// Renders the lamp into `image`, whose storage is reused; of width 0 if no light of the lamp
  /// reaches the sensor. Returns false if part of its rim is outside the camera's domain or its
  /// dark side is visible.
  bool render(const Lamp& lamp, PaddedPatch& image) const;

  /// The camera of the image: without distortion when the plan leaves it out.
  const Camera& camera() const { return camera_; }
  const Motion& motion() const { return motion_; }

 private:
  // `lamp` is rendered as a point; `face` is the lamp with its shape, which boxes may hide partly.
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
  const Blur* blur_ = nullptr;     // null: no blur
  const PixelPsf* psf_ = nullptr;  // PSF of blur_
  double spacing_px_ = 1;
};

}  // namespace occ::internal::simulate
