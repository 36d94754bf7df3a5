// SPDX-License-Identifier: Apache-2.0
// Displacement of the points of a measured rim by the light of its lamp.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "libocc/core/abi.hpp"
#include "libocc/core/blob.hpp"
#include "libocc/formation/light.hpp"

namespace occ::internal::refine {

/// Without Blob::rim_light_response_px, all points move by light_shift_px(). With it, each moves
/// by the brightness near it: the ends of a long lamp that differ in brightness make its image
/// wider at one end, which is no shift.
class LIBOCC_API RimLight {
 public:
  /// Keeps a reference to the blob.
  RimLight(const Lamp& lamp, const Blob& blob, const Rigid3& cam_from_world, const Scene& scene);

  /// Displacement of a rim point with this unit normal.
  Eigen::Vector2d displacement_px(const Eigen::Vector2d& px, const Eigen::Vector2d& normal) const;

 private:
  /// ln of the brightness at an offset from the blob's centre, over that at the centre.
  struct Brightness {
    Eigen::Vector2d gradient;  ///< [1/px]
    Eigen::Matrix2d bend;      ///< second derivatives [1/px^2]
  };
  std::optional<Brightness> brightness(const Lamp& lamp, const Rigid3& cam_from_world,
                                       const Scene& scene) const;

  const Blob& blob_;
  std::optional<Brightness> brightness_;
  Eigen::Vector2d shift_px_ = Eigen::Vector2d::Zero();
};

}  // namespace occ::internal::refine
