// SPDX-License-Identifier: Apache-2.0
#include "libocc/radiometry/lambertian.hpp"

#include <algorithm>
#include <cmath>

#include "libocc/core/math.hpp"
#include "libocc/core/require.hpp"

namespace occ {
namespace {

constexpr double grazing_cos = 0.01;  // min cosine for m < 1, where radiance diverges

// The test is here because these functions run once per rim sample: a valid value costs no text.
void require_above_zero(double value, const char* name) {
  if (!(value > 0)) require(false, name, value, "positive");
}

}  // namespace

double lambertian_order(double half_power_rad) {
  require(half_power_rad > 0 && half_power_rad < pi / 2, "half_power_rad", half_power_rad,
          "in (0, pi/2)");
  // ln cos without cancellation at narrow beams: cos = 1 - 2 sin^2(half).
  const double s = std::sin(half_power_rad / 2);
  return -std::log(2.0) / std::log1p(-2 * s * s);
}

double radiant_intensity(double power_w, double order, double cos_emission) {
  if (cos_emission <= 0) return 0;
  return power_w * (order + 1) / (2 * pi) * std::pow(cos_emission, order);
}

double radiance(double power_w, double order, double area_m2, double cos_emission) {
  require_above_zero(area_m2, "area_m2");
  if (cos_emission <= 0) return 0;
  const double c = order < 1 ? std::max(cos_emission, grazing_cos) : cos_emission;
  return power_w * (order + 1) / (2 * pi * area_m2) * std::pow(c, order - 1);
}

double aperture_power(double power_w, double order, double cos_emission, double cos_incidence,
                      double distance_m, double area_m2) {
  require_above_zero(distance_m, "distance_m");
  require_above_zero(area_m2, "area_m2");
  if (cos_incidence <= 0) return 0;
  return radiant_intensity(power_w, order, cos_emission) * area_m2 * cos_incidence /
         (distance_m * distance_m);
}

double dbm(double power_w) {
  require(power_w >= 0, "power_w", power_w, "zero or positive");
  return 10 * std::log10(power_w / 1e-3);
}

double sensor_irradiance(double radiance, double f_number, double cos_incidence) {
  require_above_zero(f_number, "f_number");
  if (cos_incidence <= 0) return 0;
  const double c2 = cos_incidence * cos_incidence;
  return pi / 4 / (f_number * f_number) * c2 * c2 * radiance;
}

}  // namespace occ
