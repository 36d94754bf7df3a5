// SPDX-License-Identifier: Apache-2.0
// Size and orientation of a lamp from its rims in pictures of known pose. Minimises the distances
// of rim points (formation/rim.hpp) over the lamp's rotation about its centre and the logarithm of
// its size; the centre is known. The error that the points of a rim share (growth) is a part of the
// variance of each point, multiplied by their number, so that it does not average out.
#pragma once

#include <cmath>
#include <vector>

#include "libocc/camera/camera.hpp"
#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/core/math.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/lamp.hpp"
#include "libocc/survey/internal/lamp_view.hpp"

namespace occ::internal::survey {

/// Rim of the lamp in one picture.
struct RimInPicture {
  const Blob* blob = nullptr;
  Rigid3 cam_from_world;
};

/// Fits radius_m or size_m, normal and x_axis from the values of `lamp`; sets size_sigma and
/// tilt_sigma_rad. False, with the lamp unchanged, if the rims do not determine them.
bool fit_shape(Lamp& lamp, const std::vector<RimInPicture>& rims, const Camera& camera);

/// View of a lamp in a picture of known pose.
struct ViewInPicture {
  const LampShapeView* view = nullptr;
  const Blob* blob = nullptr;
  Rigid3 cam_from_world;
};

/// Radius of a disc, or of the disc with the area of a rectangle.
inline double size_of(const Lamp& lamp) {
  return lamp.shape == LampShape::disc ? lamp.radius_m : std::sqrt(lamp.size_m.prod() / pi);
}

/// Result of shape_of_views().
struct ShapeOfViews {
  Lamp lamp;               ///< centre, shape, size, normal; with errors if is_fitted
  double size = 1;         ///< size_of() the lamp
  bool is_fitted = false;  ///< false: start values, the rims do not determine the shape
};

/// Shape of a lamp with a known centre from at least one view: start values from the views, then
/// fit_shape() without saturated rims, unless all are saturated. Where the two normals of a disc
/// have as many views, it is the one nearest to `normal_of_others`.
ShapeOfViews shape_of_views(const Eigen::Vector3d& centre, LampShape shape,
                            const std::vector<ViewInPicture>& views, const Camera& camera,
                            const Eigen::Vector3d& normal_of_others = Eigen::Vector3d::Zero());

}  // namespace occ::internal::survey
