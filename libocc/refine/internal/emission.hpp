// SPDX-License-Identifier: Apache-2.0
// Effect of a lamp's order of emission m on its image. At a given pixel the light is proportional
// to (m + 1) cos^(m - 1) of the emission angle (radiometry/lambertian.hpp). Relative to the light
// at the image of the lamp's centre, its derivative is
//     d ln E / d m = ln cos(emission) - ln cos(emission at the centre).
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ::internal::refine {

/// Quadratic in the image that equals d ln E / d m at nine points of the lamp's image.
class LIBOCC_API EmissionSlope {
 public:
  /// Zero everywhere.
  EmissionSlope() = default;

  /// `reach_px`: half the width and half the height of the image. Zero if a point of it is outside
  /// the camera's domain or does not see the lit side.
  EmissionSlope(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                const Eigen::Vector2d& centre_px, const Eigen::Vector2d& reach_px);

  /// d ln E / d m at a pixel.
  double at(double x, double y) const {
    const double u = x - centre_px_.x(), v = y - centre_px_.y();
    return u * (gradient_.x() + xx_ * u + xy_ * v) + v * (gradient_.y() + yy_ * v);
  }

 private:
  Eigen::Vector2d centre_px_ = Eigen::Vector2d::Zero(), gradient_ = Eigen::Vector2d::Zero();
  double xx_ = 0, xy_ = 0, yy_ = 0;
};

/// Copies the lamp's light to `changed` with another order of emission. At the image of its centre
/// the light stays the same, seen from the pose `reference`.
LIBOCC_API void change_order(const Lamp& lamp, double order, const Rigid3& reference,
                             Lamp& changed);

}  // namespace occ::internal::refine
