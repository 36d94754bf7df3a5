// SPDX-License-Identifier: Apache-2.0
// Coverage without blur by the lens: the exact area of the lamp's image inside each pixel.
//
// The rim is divided into chords. Between two neighbouring crossings of pixel borders, a chord's
// part of the contour integral is a polynomial. The area between rim and chord ("bulge", computed
// from the tangents at both ends as for a Hermite cubic) is distributed to the pixels along the
// chord. Where the rim touches or crosses a border between two pixels, some of this area is
// assigned to the wrong pixel; chords are halved until it is below 3e-8 px^2.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/formation/coverage.hpp"

namespace occ::internal::formation {

struct RimChord {
  Eigen::Vector2d from, to;
  double bulge_px2;  ///< closed integral of x dy along the rim to `to` and straight back
};
using Chords = std::vector<RimChord>;

/// Rim of a lamp's image; empty for a point lamp. nullopt as in project_contour.
LIBOCC_API std::optional<Chords> project_chords(const Lamp& lamp, const Rigid3& cam_from_world,
                                                const Camera& camera);

/// Appends the rim of a polygon in the camera's frame. Returns false if part of it is outside the
/// camera's domain.
LIBOCC_API bool append_polygon(const std::vector<Eigen::Vector3d>& corners, const Camera& camera,
                               Chords& chords);

/// Patches of zeros over all pixels that the chords may reach, clipped to the image.
LIBOCC_API CoverageMoments dark_moments(const Chords& chords, int image_width, int image_height);

/// Adds `weight` times the coverage of the shape inside the chords to the rows
/// first_row <= y < end_row, as steps along the rows. sum_rows() converts the steps to coverage.
LIBOCC_API void add_sharp_coverage(const Chords& chords, double weight, int first_row, int end_row,
                                   CoverageMoments& steps);
LIBOCC_API void sum_rows(CoverageMoments& steps);

/// Coverage of the shape inside the chords.
LIBOCC_API CoverageMoments sharp_coverage(const Chords& chords, int image_width, int image_height);

}  // namespace occ::internal::formation
