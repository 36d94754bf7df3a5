// SPDX-License-Identifier: Apache-2.0
// Coverage without any blur by the lens: the exact area of the lamp's image inside each pixel.
//
// The rim is cut into chords; between two neighbouring crossings of pixel borders a chord's share
// of the contour integral is a polynomial. The area between rim and chord ("bulge", from the
// tangents at both ends as for Hermite's cubic) goes to the pixels along the chord. Chords are
// halved until what a rim that touches or crosses a border between two pixels gives to the wrong
// one is below 3e-8 px^2.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/formation/coverage.hpp"

namespace occ::internal::formation {

struct RimChord {
  Eigen::Vector2d from, to;
  double bulge_px2;  ///< closed integral of x dy over the rim from `from` to `to` and straight back
};
using Chords = std::vector<RimChord>;

/// Rim of a lamp's image; nullopt like project_contour, empty for a point lamp.
LIBOCC_API std::optional<Chords> project_chords(const Lamp& lamp, const Rigid3& cam_from_world,
                                                const Camera& camera);

/// Appends the rim of a polygon in the camera's frame; false when part of it is outside the
/// camera's domain.
LIBOCC_API bool append_polygon(const std::vector<Eigen::Vector3d>& corners, const Camera& camera,
                               Chords& chords);

/// Returns zero patches that cover all pixels that the chords may touch, clipped to the image.
LIBOCC_API CoverageMoments dark_moments(const Chords& chords, int image_width, int image_height);

/// Adds weight times the coverage of the shape inside the chords to the rows first <= y < end of
/// the patches. A value is the sum of its row up to it once sum_rows has been called.
LIBOCC_API void add_sharp_coverage(const Chords& chords, double weight, int first_row, int end_row,
                                   CoverageMoments& steps);
LIBOCC_API void sum_rows(CoverageMoments& steps);

LIBOCC_API CoverageMoments sharp_coverage(const Chords& chords, int image_width, int image_height);

}  // namespace occ::internal::formation
