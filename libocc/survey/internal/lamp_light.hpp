// SPDX-License-Identifier: Apache-2.0
// Relative power and colour of a lamp from its blobs in pictures of known pose. For a uniform
// Lambertian face, the flux in the image is proportional to
//
//     power cos(emission) cos(incidence) / distance^2.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/lamp.hpp"

namespace occ::internal::survey {

/// Blob of a lamp in one picture.
struct BlobInPicture {
  const Blob* blob = nullptr;
  Rigid3 cam_from_world;
};

/// Result of lamp_light().
struct RelativeLight {
  /// Median over the blobs, in a unit that all lamps of the pictures share; nothing if all blobs
  /// are saturated or seen from the side.
  std::optional<double> power;
  double power_sigma = 0;  ///< relative standard deviation of `power` by the scatter of the blobs
  std::optional<Eigen::Vector3d> colour;  ///< mean of the blobs without clipped channels
};

/// Power and colour of a lamp whose centre and normal are known.
RelativeLight lamp_light(const Lamp& lamp, const std::vector<BlobInPicture>& blobs);

}  // namespace occ::internal::survey
