// SPDX-License-Identifier: Apache-2.0
// Image of a lamp in which each line (row or column, as the sensor reads out) has its own poses and
// light: rolling shutter, and motion blur of a lamp whose blinking differs between lines.
//
// Each line is painted from the lamp's appearance during the line's exposure. Points of the rim are
// projected from four poses, spread over the time in which lines see the lamp. Between these poses
// they follow the cubic through the four projections. Its error relative to the focal length is
// (rotation angle in that time)^4 / 2000.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "libocc/formation/coverage.hpp"
#include "libocc/formation/internal/lens_blur.hpp"
#include "libocc/formation/internal/sharp_coverage.hpp"
#include "libocc/simulate/internal/motion.hpp"

namespace occ::internal::simulate {

struct LineImageInput {
  const Motion& motion;
  const Camera& camera;
  const Lamp& lamp;
  const PixelPsf* psf;                       ///< null: no blur
  double spacing_px;                         ///< distance of contour points
  double panels_per_px;                      ///< parts of a line's exposure per pixel of motion
  std::vector<formation::BlurShift> shifts;  ///< defocus, in addition to the PSF
  std::function<double(double)> light;       ///< factor on the lamp's light at a time
  /// Chords of an extended lamp's image from a pose; used without a PSF.
  std::function<std::optional<formation::Chords>(const Rigid3&)> chords;
  /// Rim from a pose; used with a PSF. Empty if the rim is rigid (no part may be hidden).
  std::function<std::optional<RimContour>(const Rigid3&)> rim;
};

/// Coverage and moments of an extended lamp, with light and blinking; of width 0 if no line sees
/// it. nullopt if part of the rim is outside the camera's domain from some pose in that time.
std::optional<CoverageMoments> extended_line_image(const LineImageInput& input);

/// Light of a point lamp, under the same conditions.
std::optional<Patch> point_line_image(const LineImageInput& input);

/// Length of the path of a lamp's image in an interval of time, the largest of all points of its
/// rim [px]; 0 if it is not visible throughout.
double path_px(const Lamp& lamp, const Motion& motion, const Camera& camera, double from_s,
               double to_s);

}  // namespace occ::internal::simulate
