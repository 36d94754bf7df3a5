// SPDX-License-Identifier: Apache-2.0
// Compares the measured sizes of lamps with the sizes predicted by a pose. The centres of any three
// lamps fit some pose, so their sizes are the only check of an assignment by geometry.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/refine/refine.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::refine {

/// True if a blob is the image of one whole lamp.
inline bool is_whole(const Blob& blob) { return !blob.cut_by_border && !blob.merged; }

/// Twice the covariance of points evenly spaced on a disc's rim in the image: the matrix of its
/// squared semi-axes. Of other shapes, four times the second moments of the area, as
/// Blob::ellipse. Empty if the lamp is not visible.
LIBOCC_API std::optional<Eigen::Matrix2d> image_moments_px2(const Lamp& lamp,
                                                            const Rigid3& cam_from_world,
                                                            const Camera& camera);

/// Semi-axes (minor, major) of a disc's predicted image, from points evenly spaced on its rim;
/// empty if the lamp is not visible.
LIBOCC_API std::optional<Eigen::Array2d> predicted_axes_px(const Lamp& lamp,
                                                           const Rigid3& cam_from_world,
                                                           const Camera& camera);

/// Semi-axes (minor, major) of the second moments of the light of a rectangle or Lame curve, two
/// standard deviations, without blur; empty for other shapes or if the lamp is not visible.
LIBOCC_API std::optional<Eigen::Array2d> predicted_light_axes_px(const Lamp& lamp,
                                                                 const Rigid3& cam_from_world,
                                                                 const Camera& camera);

/// Message about a lamp whose size contradicts the pose; empty if there is none. Lamps identified
/// by their codes, saturated lamps (their rims have grown) and lamps that were left out are not
/// tested.
LIBOCC_API std::string size_contradiction(const Refined& refined, const std::vector<Blob>& blobs,
                                          const Scene& scene);

}  // namespace occ::internal::refine
