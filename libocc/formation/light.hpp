// SPDX-License-Identifier: Apache-2.0
// Computes the light of a lamp on the sensor: the irradiance at a point of the image, and the
// electrons of the lamp's whole image.
//
//   aperture     A = pi/4 fx fy pitch^2 / N^2                       area of the lens opening [m^2]
//   irradiance   E = L(phi) A cos(psi) dOmega / dS                  [W/m^2]
//   whole image  P = I(phi) A cos(psi) / d^2                        [W]
//
// dOmega/dS is the solid angle seen by a unit of sensor area. For a pinhole it is cos^3(psi)/f^2,
// and E becomes pi/4 / N^2 cos^4(psi) L (radiometry/lambertian.hpp, which also defines L, I, phi,
// psi, N). A lens with distortion spreads the same light over another area, so the sum of E over
// the image is P for every camera. With Lamp::photometry, I is P f(theta, C)
// (radiometry/emission_profile.hpp) and L is I / (S cos(phi)).
#pragma once

#include <Eigen/Core>
#include <memory>

#include "libocc/core/abi.hpp"
#include "libocc/geometry/rigid.hpp"
#include "libocc/scene/scene.hpp"

namespace occ {
namespace internal::scene {
class LampEmission;
}

/// Area A of the lens opening [m^2].
LIBOCC_API double aperture_m2(const Camera& camera, const Sensor& sensor);

/// Irradiance E [W/m^2] by an extended lamp at a pixel, as if the pixel were inside the lamp's
/// image. 0 if the pixel is outside the camera's domain or its ray does not meet the lit side of
/// the lamp's plane. Throws std::invalid_argument for a point lamp, which has no radiance.
LIBOCC_API double irradiance_at(const Lamp& lamp, const Rigid3& cam_from_world,
                                const Camera& camera, const Sensor& sensor,
                                const Eigen::Vector2d& px);

/// Computes irradiance_at() for many pixels of one image. Lamp and camera must outlive the object.
class LIBOCC_API LampIrradiance {
 public:
  /// Computes what is common to all pixels.
  LampIrradiance(const Lamp& lamp, const Rigid3& cam_from_world, const Camera& camera,
                 const Sensor& sensor);
  /// Irradiance [W/m^2] at a pixel; throws for a point lamp, as irradiance_at() does.
  double at(const Eigen::Vector2d& px) const;

 private:
  const Lamp& lamp_;
  const Camera& camera_;
  Eigen::Vector3d normal_;  // in the camera's frame
  double order_, area_m2_, per_radiance_;
  std::shared_ptr<const internal::scene::LampEmission> measured_;  // none for a Lambertian lamp
  bool shines_;  // the camera is on the lit side of the lamp's plane
};

/// Irradiance [W/m^2] of a pixel that sees a surface of this radiance [W/(m^2 sr)] along a unit
/// bearing. The pixel sees the solid angle `solid_angle_sr` = |d bearing/dx x d bearing/dy|.
LIBOCC_API double irradiance_of_radiance(double radiance, const Camera& camera,
                                         const Sensor& sensor, const Eigen::Vector3d& bearing,
                                         double solid_angle_sr);

/// Gradient of ln(irradiance_at) [1/px]. It is zero if the irradiance is zero, if the pixel is less
/// than half a pixel inside the camera's domain, and for a point lamp.
LIBOCC_API Eigen::Vector2d log_irradiance_gradient(const Lamp& lamp, const Rigid3& cam_from_world,
                                                   const Camera& camera, const Sensor& sensor,
                                                   const Eigen::Vector2d& px);

/// Signal electrons P of the lamp's whole image while lit, before clipping, by the aperture formula
/// at the lamp's centre. Exact for a point lamp; relative error of order (size/d)^2 for other
/// shapes. 0 if the lamp's dark side is visible or it is behind the camera. `log_jacobian` (1x6) is
/// d ln(electrons) / d pose perturbation, zero if there is no light.
LIBOCC_API double lamp_electrons(const Lamp& lamp, const Rigid3& cam_from_world,
                                 const Camera& camera, const Sensor& sensor,
                                 Eigen::Matrix<double, 1, 6>* log_jacobian = nullptr);

}  // namespace occ
