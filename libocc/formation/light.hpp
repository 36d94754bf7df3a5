// SPDX-License-Identifier: Apache-2.0
// Light of a lamp on the sensor: irradiance at an image point, and the electrons of the lamp's
// whole image.
//
//   aperture     A = pi/4 fx fy pitch^2 / N^2                       area of the lens opening [m^2]
//   irradiance   E = L(phi) A cos(psi) dOmega / dS                  [W/m^2]
//   whole image  P = I(phi) A cos(psi) / d^2                        [W]
//
// dOmega/dS is the solid angle that a unit of sensor area sees. For a pinhole it is cos^3(psi)/f^2
// and E becomes pi/4 / N^2 cos^4(psi) L (radiometry/lambertian.hpp); a lens that distorts spreads
// the same light over another area, so that E summed over the image is P for every camera.
// L, I, phi, psi, N: see radiometry/lambertian.hpp.
#pragma once

#include <Eigen/Core>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {

/// Area of the lens opening [m^2], the A above.
LIBOCC_API double aperture_m2(const Camera& camera, const Sensor& sensor);

/// Irradiance [W/m^2] of an extended lamp at a pixel, as if that pixel were inside the lamp's
/// image. 0 if the pixel is outside the camera's domain or its ray does not meet the lit side of
/// the lamp's plane. Throws std::invalid_argument for a point lamp, which has no radiance.
LIBOCC_API double irradiance_at(const Lamp& lamp, const Rigid3& cam_from_world,
                                const Camera& camera, const Sensor& sensor,
                                const Eigen::Vector2d& px);

/// Computes irradiance_at() for many pixels of one image; lamp and camera must outlive it.
class LIBOCC_API LampIrradiance {
 public:
  LampIrradiance(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                 const Sensor& sensor);
  double at(const Eigen::Vector2d& px) const;

 private:
  const Lamp& lamp_;
  const Camera& camera_;
  Eigen::Vector3d normal_;  // in the camera's frame
  double order_, area_m2_, per_radiance_;
  bool shines_;  // the ray must meet the plane in front of the camera, and on its lit side
};

/// Irradiance [W/m^2] where a surface of this radiance [W/(m^2 sr)] is seen along a unit bearing; a
/// pixel sees `solid_angle_sr` there: |d bearing/dx x d bearing/dy|.
LIBOCC_API double irradiance_of_radiance(double radiance, const Camera& camera,
                                         const Sensor& sensor, const Eigen::Vector3d& bearing,
                                         double solid_angle_sr);

/// Gradient of ln(irradiance_at) [1/px]; zero where that is zero or the pixel lies less than half a
/// pixel inside the camera's domain, and for a point lamp.
LIBOCC_API Eigen::Vector2d log_irradiance_gradient(const Lamp& lamp, const Rigid3& cam_from_world,
                                                   const Camera& camera, const Sensor& sensor,
                                                   const Eigen::Vector2d& px);

/// Signal electrons of the lamp's whole image while lit, before clipping, by the aperture formula
/// at the lamp's centre: exact for a point, relative error of order (size/d)^2 for the others. 0
/// if it shows its dark side or is behind the camera. `log_jacobian` (1x6): d ln(electrons) / d
/// pose perturbation, zero if there is no light.
LIBOCC_API double lamp_electrons(const Lamp& lamp, const Rigid3& cam_from_world,
                                 const Camera& camera, const Sensor& sensor,
                                 Eigen::Matrix<double, 1, 6>* log_jacobian = nullptr);

}  // namespace occ
