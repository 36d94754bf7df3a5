// SPDX-License-Identifier: Apache-2.0
// A lamp's image in which every line (row or column, whichever the sensor reads out) has its own
// poses and light: rolling shutter, and motion blur of a lamp that blinks by lines.
//
// Each line is painted from the lamp as it is seen during the line's exposure. Points of the rim
// are projected from four poses over the time in which lines see the lamp; in between they follow
// the cubic through those, which misses by (angle turned in that time)^4 / 2000 of the focal
// length.
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
  const PixelPsf* psf;                       ///< none: no blur
  double spacing_px;                         ///< of contour points
  double panels_per_px;                      ///< of blur, into which a line's exposure is cut
  std::vector<formation::BlurShift> shifts;  ///< what the lens adds to the PSF
  std::function<double(double)> light;       ///< factor of the lamp's light at a time
  /// Of an extended lamp's image from a pose: without a PSF.
  std::function<std::optional<formation::Chords>(const Rigid3&)> chords;
  /// With one; given when it does not simply move along with the pose (parts may be hidden).
  std::function<std::optional<RimContour>(const Rigid3&)> rim;
};

/// Coverage and moments of an extended lamp, with light and blinking; empty when no line sees it.
/// Nothing when part of the rim cannot be seen from some pose in that time.
std::optional<CoverageMoments> extended_line_image(const LineImageInput& input);

/// The light of a point lamp; alike.
std::optional<Patch> point_line_image(const LineImageInput& input);

/// Length of the path of a lamp's image in a time, the longest of its rim's points [px]; 0 where it
/// is not seen from all of it.
double path_px(const Lamp& lamp, const Motion& motion, const Camera& camera, double from_s,
               double to_s);

}  // namespace occ::internal::simulate
