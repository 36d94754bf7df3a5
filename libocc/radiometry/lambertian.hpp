// SPDX-License-Identifier: Apache-2.0
// Light from a generalised Lambertian lamp. SI units, angles in radians.
//
//   order       m = -ln 2 / ln cos(phi_half)
//   intensity   I(phi) = P (m+1)/(2 pi) cos^m(phi)                                   [W/sr]
//   radiance    L(phi) = I(phi) / (S cos phi)                                        [W/(m^2 sr)]
//   aperture    P_r = I(phi) A cos(psi) / d^2                                        [W]
//   in dBm      10 log10(P_r / 1 mW)
//   irradiance  E = pi/4 / N^2 cos^4(psi) L   on the sensor, focused at infinity     [W/m^2]
//
// phi: emission angle from the lamp's normal, zero light for phi >= pi/2; psi: incidence angle from
// the optical axis; S: lamp area; N: f-number. Sources: Gfeller & Bapst, Proc. IEEE 67(11) 1979, eq
// (2), for the order; Horn, "Robot Vision" (1986), section 10.3, for the camera equation.
#pragma once

#include "libocc/core/abi.hpp"

namespace occ {

/// Order m of a half-power semi-angle in (0, pi/2); 1 for 60 degrees. Throws outside that range.
LIBOCC_API double lambertian_order(double half_power_rad);

/// I(phi) [W/sr] from cos(phi); 0 for cos_emission <= 0.
LIBOCC_API double radiant_intensity(double power_w, double order, double cos_emission);

/// L(phi) [W/(m^2 sr)] of a flat source. For m < 1 it diverges at grazing emission, so values of
/// cos(phi) below 0.01 (89.4 degrees) are replaced by 0.01.
LIBOCC_API double radiance(double power_w, double order, double area_m2, double cos_emission);

/// Power [W] through an aperture of area_m2 at distance_m. For 1 m^2 it equals the irradiance
/// [W/m^2] of a surface there.
LIBOCC_API double aperture_power(double power_w, double order, double cos_emission,
                                 double cos_incidence, double distance_m, double area_m2);

/// Power in decibels relative to one milliwatt; minus infinity for zero power. Throws for
/// power_w < 0.
LIBOCC_API double dbm(double power_w);

/// E [W/m^2] on the sensor for a scene radiance, at incidence angle psi.
LIBOCC_API double sensor_irradiance(double radiance, double f_number, double cos_incidence);

}  // namespace occ
